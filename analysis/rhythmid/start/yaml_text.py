"""signals.yaml and model.yaml as text, with the reason and the alternatives of every guess as comments."""

import json
import re
import textwrap
from collections.abc import Iterator, Sequence
from contextlib import contextmanager

import numpy as np

from rhythmid.elements.element import SLOTS
from rhythmid.errors import InputError
from rhythmid.model import INERTIA, Term
from rhythmid.record.clock_time import DAY
from rhythmid.record.heading import heading_of
from rhythmid.record.held_command import held_note
from rhythmid.record.inventory import Inventory, Recorded, header_clock
from rhythmid.record.record import Channel
from rhythmid.record.signals import ROLES, Clock
from rhythmid.record.table_clock import UNITS
from rhythmid.start.meaning import driving_unit_of, is_measured_effort, meaning_of, tells_unit
from rhythmid.start.nominal import Nominal
from rhythmid.start.role_choice import Choice
from rhythmid.start.roles import Roles
from rhythmid.units import Units
from rhythmid.value import Value

GUESSED = "guessed signals.yaml"  # name in messages of the file that is not written yet
WIDTH = 110
SCALES = {DAY, *(scale for scale, _ in UNITS[1:])}  # of times that are not in seconds, where none is stated
LISTED = 8  # largest number of alternatives in a comment
MEANS = {
    "input": "what drives the machine", "output": "the measured motion", "velocity": "its velocity, as recorded beside it",
    "effort": "the measured effort of the actuator", "reference": "what the controller is asked for",
    "forcing": "what pushes in addition to the input",
}  # fmt: skip


@contextmanager
def as_guessed() -> Iterator[None]:
    """Context in which errors refer to the guesses, not to a line of a file that does not exist yet."""
    try:
        yield
    except InputError as error:
        said = re.sub(rf"^{re.escape(GUESSED)}(?::\d+)?: ", "guessed ", str(error))
        raise type(error)(said) from error


def signals_yaml(
    found: Inventory,
    roles: Roles,
    units: Units,
    clock: Clock,
    clock_reason: str,
    use: str = "",
    maybe: str | None = None,
) -> str:
    """The text of signals.yaml; `use` is its line for the free part of the records, `maybe` one that is only suggested."""
    lines = [
        *comment(f"Which channel of {found.path.name} is what. Guessed by `rhythmid init`: look through it and correct what is wrong."),
        "",
        *comment(f"time: {clock_reason}."),
        *_time_doubt(clock),
        f"time: {time_of(clock)}",
    ]  # fmt: skip
    for role in ROLES:
        if role in roles.choices:
            choice = roles.choices[role]
            lines += [
                "",
                *_said(role, choice),
                *([] if role != "input" else _held_comment(choice.recorded, roles)),
                *_unit_doubt(choice.recorded, _unit(role, choice.recorded, roles, units)),
                f"{role}: {_channel(role, choice, roles, units, found.is_bag)}",
            ]
        elif role == "input" and "effort" not in roles.choices:
            why = "nothing that was recorded drives the machine" + (
                "" if "forcing" not in roles.choices else " but the forcing"
            )
            lines += ["", *comment(f"input: {why}."), "input: none"]
    taken = [choice.recorded for choice in roles.choices.values()]
    rest = [
        str(one)
        for one in found.recorded
        if not any(one is other for other in taken) and roles.joint.includes(one, meaning_of(one))
    ]
    if roles.joint.others:
        moved = ", ".join(
            f"{name} ({roles.joint.motion[name]:.3g})" for name in roles.joint.others[: 2 * LISTED]
        )
        name, own = roles.joint.name, roles.joint.motion[roles.joint.name]
        lines += [
            "",
            *comment(
                f"joint: {name}; standard deviation of its motion {own:.3g}. Others (--joint NAME): {moved}."
            ),
        ]
    for note in (*found.notes, *roles.notes):
        lines += ["", *comment(f"CHECK: {note}.")]
    if rest:
        lines += ["", *comment(f"Recorded too, and not used: {_listed(rest, 3 * LISTED)}.")]
    left = [why for why in found.left_out if not any(why.startswith(f"{one}: ") for one in taken)]
    if left:
        lines += ["", *comment(f"Left out: {_listed(left, LISTED)}.")]
    if use:
        lines += ["", *comment("Only the part in which the machine moves freely (CHECK), s:"), use]
    else:
        lines += ["", *comment("Only a part of the record:"), f"# {maybe or _whole(roles):<40}# s"]
    return "\n".join(lines) + "\n"


def _whole(roles: Roles) -> str:
    """The line that uses the whole record, on the clock of its output."""
    time = roles.choices["output"].recorded.time
    # milliseconds also of times since 1970
    begin, end = (f"{t:.{max(6, len(str(int(abs(t)))) + 3)}g}" for t in (float(time[0]), float(time[-1])))
    return f"use: [{begin}, {end}]"


def _time_doubt(clock: Clock) -> list[str]:
    """A comment on a unit of times that no heading states and that is not the second."""
    heading = heading_of(str(clock.column))
    if clock.kind == "column" and heading.unit and heading.scale != clock.scale:
        return comment(f"  CHECK: the unit of its heading, {heading.written}, is not the one that is taken.")
    if clock.kind != "column" or clock.scale not in SCALES or heading.unit:
        return []
    return comment(
        "  CHECK: no heading gives the unit of the times; it is inferred from the size of their steps."
    )


def clock_of(found: Inventory, roles: Roles) -> tuple[Clock, str]:
    """Source of the times; for a bag stamps, where all chosen topics have them."""
    if not found.is_bag:
        return found.clock, found.clock_reason
    return header_clock({role: choice.recorded for role, choice in roles.choices.items()})


def model_yaml(nominal: Nominal, roles: Roles, units: Units, explicit: bool) -> str:
    """The text of model.yaml; `explicit` where the file has to declare its units."""
    model = nominal.model
    lines = [
        *comment(
            "A nominal model to begin with, guessed by `rhythmid init` from what was recorded: put in what is known of the machine. "
            "All values that are not fixed are estimated."
        ),
        "",
        *comment(f"It {'turns' if roles.rotary else 'slides'}: {roles.rotary_reason}."),
    ]
    if explicit:
        lines.append(
            f"units: {{force: {json.dumps(units.force)}, position: {units.position}, mass: {json.dumps(units.mass)}}}"
        )
    lines += ["", *_why(INERTIA, nominal), f"inertia: {{mass: {_value(model.mass)}}}"]
    for slot in SLOTS:
        terms = [term for term in model.terms if term.element.slot == slot]
        if terms:
            lines += ["", f"{slot}:"]
            for term in terms:
                lines += [
                    *(f"  {line}" for line in _why(term.label, nominal)),
                    f"  - {_term(term)}",
                ]
    for remark in nominal.remarks:
        lines += ["", *comment(remark)]
    return "\n".join(lines) + "\n"


def _why(label: str, nominal: Nominal) -> list[str]:
    """The reason for a part of the model, and doubts about it."""
    lines = comment(f"{nominal.reasons[label]}.")
    return lines + (comment(f"  CHECK: {nominal.doubts[label]}.") if label in nominal.doubts else [])


def _term(term: Term) -> str:
    return f"{term.element.name}: {{{', '.join(f'{name}: {_value(value)}' for name, value in term.values.items())}}}"


def _value(value: Value) -> str:
    parts = [f"value: {value.value:g}", f"unit: {json.dumps(value.unit)}"]
    if value.fixed:
        parts.append("fixed: true")
    if value.prior is not None:
        parts.append(f"prior: {{mean: {value.prior.mean:g}, std: {value.prior.std:g}}}")
    return f"{{{', '.join(parts)}}}"


def time_of(clock: Clock) -> str:
    """The clock in the notation of signals.yaml."""
    if clock.kind == "rate":
        return f"{{sample_rate: {clock.rate!r}}}"
    if clock.kind == "column":
        return f"{{column: {_quoted(str(clock.column))}{_scale(clock.scale)}}}"
    return clock.kind


def _channel(role: str, choice: Choice, roles: Roles, units: Units, bag: bool) -> str:
    one = choice.recorded
    parts = (
        [f"topic: {one.topic}, field: {_quoted(one.field)}"] if bag else [f"column: {_quoted(one.column)}"]
    )
    parts.append(f"unit: {json.dumps(_unit(role, one, roles, units))}{_scale(one.scale * choice.scale)}")
    if choice.offsets:
        own = ", ".join(f"{json.dumps(name)}: {value:.10g}" for name, value in choice.offsets.items())
        parts.append(f"offset: {{{own}}}")
    elif choice.offset:
        parts.append(f"offset: {choice.offset:.10g}")
    if one.sign_bit is not None:
        parts.append(f"sign_bit: {one.sign_bit}")
    if role == "output" and roles.output_kind != "position":
        parts.append(f"kind: {roles.output_kind}")
    if role == "input":
        if roles.input_kind != "force":
            parts.append(f"kind: {roles.input_kind}")
        held = (
            roles.input_kind == "reference"
            or meaning_of(one).commanded is True
            or _is_like_a_command(one, roles)
            or bool(_held_note(one, roles))
        )
        if not bag and held:
            parts.append("hold: zero")
        elif bag and not held:
            parts.append("hold: linear")
    return f"{{{', '.join(parts)}}}"


def _is_like_a_command(one: Recorded, roles: Roles) -> bool:
    """Whether an effort of a bag of which no name says who set it has messages without stamps: the types of
    sensors (`sensor_msgs`) have stamps, and those in which controllers receive commands have none
    (`std_msgs/Float64MultiArray` of ros2_controllers)."""
    unsaid = meaning_of(one).commanded is None and not is_measured_effort(one)
    return bool(one.topic) and roles.input_kind == "force" and not one.stamped and unsaid


def _held_note(one: Recorded, roles: Roles) -> str | None:
    """Note on an input whose samples show a hold."""
    there = [(each, np.isfinite(each.value)) for each in (one, roles.choices["output"].recorded)]
    return held_note(*(Channel(each.time[kept], each.value[kept], each.unit) for each, kept in there))


def _held_comment(one: Recorded, roles: Roles) -> list[str]:
    """A comment where the samples or messages of the driving signal show a hold that no name states."""
    if meaning_of(one).commanded or roles.input_kind == "reference":
        return []
    if _is_like_a_command(one, roles):
        note = (
            "its messages have no stamps, as those of commands, so each is taken as held until the next one (hold: zero); "
            "where it was measured, say  hold: linear"
        )
    else:
        note = _held_note(one, roles)
    return comment(f"  CHECK: {note}.") if note else []


def _unit(role: str, one: Recorded, roles: Roles, units: Units) -> str:
    position = units.position
    by_kind = {"position": position, "velocity": f"{position}/s", "acceleration": f"{position}/s^2"}
    if role == "output":
        return by_kind[roles.output_kind]
    if role == "velocity":
        return by_kind["velocity"]
    if role == "reference" or (role == "input" and roles.input_kind == "reference"):
        return by_kind[roles.reference_of]
    if role == "input" and roles.input_kind != "force":
        return by_kind[roles.input_kind.removeprefix("base_").replace("displacement", "position")]
    return driving_unit_of(one) or ("N*m" if roles.rotary else "N")


def _unit_doubt(one: Recorded, unit: str) -> list[str]:
    """A comment on a unit that neither a heading nor a message type states."""
    if one.unit and one.unit != unit:
        return comment(
            f"  CHECK: its heading says {one.written_unit}, and {unit} is needed: scale: how many {unit} one {one.unit} is."
        )
    if tells_unit(one):
        return []
    return comment(
        f"  CHECK: no unit is stated; {unit} is assumed. For another one:  scale: the size of its unit in {unit}."
    )


def _scale(scale: float) -> str:
    return "" if scale == 1.0 else f", scale: {scale:.10g}"


def _said(role: str, choice: Choice) -> list[str]:
    """The reason for a choice, doubts, and alternatives for the role."""
    one = choice.recorded
    lines = comment(f"{role}, {MEANS[role]}: {choice.reason}.")
    if one.scale != 1.0:
        lines += comment(f"  scale: its heading says {one.written_unit}.")
    if one.sign_bit is not None:
        lines += comment(f"  CHECK: {doubt_of_sign(one.sign_bit)}.")
    for doubt in choice.doubts:
        lines += comment(f"  CHECK: {doubt}.")
    if choice.others:
        lines += comment(f"  or else: {_listed([str(other) for other in choice.others], LISTED)}.")
    return lines


def doubt_of_sign(bit: int) -> str:
    """Doubt about a number that seems to be a word with a sign bit."""
    size = 2**bit
    return (
        f"its numbers jump between those near 0 and those above {size}, as words do whose bit {bit} is their sign: sign_bit: {bit} takes "
        f"{size + 32} for -32; delete it where they are ordinary numbers"
    )


def _listed(names: Sequence[str], most: int) -> str:
    more = f" and {len(names) - most} more" if len(names) > most else ""
    return "; ".join(names[:most]) + more


def _quoted(text: str) -> str:
    return json.dumps(text, ensure_ascii=False)


def comment(text: str) -> list[str]:
    """Lines of a comment in YAML."""
    indent = " " * (len(text) - len(text.lstrip()))
    return [f"# {line}" for line in textwrap.wrap(text.strip(), WIDTH, initial_indent=indent, subsequent_indent=indent + "  ",
                                                 break_long_words=False, break_on_hyphens=False)]  # fmt: skip
