"""Assigns roles to recorded numbers: driving signal, output and further signals, each with its reason."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial

import numpy as np

from rhythmid.errors import InputError
from rhythmid.record.inventory import Inventory, Recorded
from rhythmid.record.output_copy import doubt_of_copy
from rhythmid.record.signals import InputKind, OutputKind
from rhythmid.record.table_clock import is_time
from rhythmid.start.by_data import by_data, note_of_unknown, output_by_data
from rhythmid.start.carried import carried_motion
from rhythmid.start.copies import copies_output, note_of_copy, note_of_sensor
from rhythmid.start.direction import by_direction, notes_of_other_joints
from rhythmid.start.drivers import drivers
from rhythmid.start.joint import Joint, joint_of, shows_motion
from rhythmid.start.meaning import (
    Quantity,
    doubt_of_letter,
    is_ignored,
    is_lone_v,
    meaning_of,
    says_who_asks,
)
from rhythmid.start.poses import with_joint_positions
from rhythmid.start.relation import RATIO, coherent, derivative, goes_along, runs_like_a_clock
from rhythmid.start.role_choice import Ask, Choice, Known, pick, ranked_by_worth
from rhythmid.start.rotary import rotary_of, rotary_of_wrench
from rhythmid.start.slopes import with_integrals, without_slopes
from rhythmid.start.step_before import BEFORE, duty_before, gone_to_set_point, set_point_before, step_before
from rhythmid.start.symbols import with_symbols
from rhythmid.start.targets import with_targets
from rhythmid.start.unnamed_joints import column_groups
from rhythmid.start.unnamed_reference import with_reference
from rhythmid.start.unsigned_effort import without_unsigned
from rhythmid.start.written_twice import written_once

INTEGRAL = 0.9  # correlation above which a position and a velocity belong together
PER_MINUTE = 0.02  # by which a ratio of one to sixty may be off: that of degrees is 5 % off
UNTOLD = "no name or unit says it; where it turns, say so with units of rad and N*m"
MEASURED: tuple[Quantity, ...] = ("position", "velocity", "acceleration")


@dataclass(frozen=True, eq=False)
class Roles:
    """Roles by name as in signals.yaml, the kinds of input and output, whether the machine is rotational, and notes."""

    choices: Mapping[str, Choice]
    input_kind: InputKind
    output_kind: OutputKind
    rotary: bool
    rotary_reason: str
    joint: Joint
    reference_of: Quantity = "position"
    notes: tuple[str, ...] = field(default_factory=tuple)


def first_answer(question: str, answers: Sequence[str]) -> int:
    """Return the best guess without asking."""
    return 0


def guess_roles(
    found: Inventory, joint: str | None = None, ask: Ask = first_answer, stepped: Collection[str] = ()
) -> Roles:
    """Roles of the numbers in a source, of which those named in `stepped` change from one source to the next. Raises
    InputError where no number can be the output, or no joint is called `joint`."""
    stated = [Known(one, meaning_of(one)) for one in found.recorded if one.stated is not None]
    known = [
        Known(one, meaning_of(one))
        for one in found.recorded
        if one.stated is None and not is_ignored(one) and not _is_clock(one)
    ]
    known, twice = written_once(
        without_slopes(with_symbols(_without_empty_letters(with_joint_positions(known))))
    )
    known += stated
    moved = next((one for one in stated if one.one.stated == "output"), None)
    everything = [*known, *(Known(one, meaning_of(one)) for one in found.constant)]
    known, resting = (with_targets(part, everything) for part in (known, everything[len(known) :]))
    known = with_integrals(known)
    if not known:
        raise InputError(f"{found.path}: holds nothing that could be a motion")
    if (groups := column_groups(found)) is not None:
        known, resting = ([groups.told(one) for one in part] for part in (known, resting))
    said = [(one.one, one.meaning) for one in known]
    joint = joint if moved is None else moved.meaning.joint or None
    carried = carried_motion(said) if joint is None and not stated else None
    still = [(one.one, one.meaning) for one in resting]
    unnamed = carried is not None or (moved is not None and joint is None)
    chosen = Joint() if unnamed else joint_of(said, still, joint, ask, str(found.path))
    everything = known
    known = [one for one in known if one.one.stated is not None or chosen.includes(one.one, one.meaning)]
    if carried is not None:
        notes = [*twice]
        output = Choice(carried.driven, f"a measured position: {carried.reason}", (carried.driver,))
    elif moved is not None:
        notes = [*twice]
        output = Choice(moved.one, f"a measured {moved.quantity}: {moved.meaning.reason}")
    else:
        output, known = _output(known, ask, str(found.path), found.constant, chosen)
        output, known, exchanged = by_direction(output, known)
        notes = [*twice, *exchanged]
    choices = {"output": output}
    own = next(one for one in known if one.one is output.recorded)
    measured = own.quantity or "position"
    rest = [
        one
        for one in known
        if one.one is not output.recorded and not _of_other_side(one.one, output.recorded)
    ]
    velocity = _velocity(output, measured, rest)
    if velocity is not None:
        choices["velocity"] = velocity
        rest = [one for one in rest if one.one is not velocity.recorded]
    rest = [_voltage(one, output.recorded, measured) for one in rest]
    rest, copies, told = _without_copies(rest, output.recorded)
    notes += told
    rest, told = without_unsigned(rest, output.recorded, measured)
    notes += told
    told_by_data = [(one, by_data(one, output.recorded, measured, velocity)) for one in rest]
    notes += [
        note_of_sensor(now) for was, now in told_by_data if was is not now and now.meaning.commanded is False
    ]
    rest = [now for _, now in told_by_data]
    if driven := [one for one in stated if one is not moved]:
        rest = [one if one.quantity else one.taken_for(measured, one.meaning.reason) for one in driven]
    more, kind, reference_of = drivers(rest, output.recorded, measured, ask)
    if carried is not None:
        reason = f"a motion that drives {carried.driven}, and nothing else drives"
        more = {"input": Choice(carried.driver, reason, doubts=(carried.doubt,))}
    step = None if more else step_before(found.constant, chosen, stepped)
    if step is not None:
        more = {"input": Choice(*step, doubts=(BEFORE,))}
    only = more.get("input") if len(more) == 1 and kind == "force" else None
    duty = duty_before(found.constant, chosen, output.recorded, measured) if only is not None else None
    if (
        only is not None
        and not driven
        and duty not in (None, only.recorded)
        and meaning_of(only.recorded).commanded is not True
    ):
        reason = f"it feeds a motor from the first sample on, and the machine starts from rest; {only.recorded} was measured"
        more = {"input": Choice(duty, reason, (only.recorded, *only.others), (BEFORE,))}
    if (
        not more
        and (asked := set_point_before(found.constant, chosen, output.recorded, measured)) is not None
    ):
        reason = f"a {measured} that was asked for, to which the output goes, and nothing else drives"
        more = {"input": Choice(asked, reason, doubts=(BEFORE,))}
        kind, reference_of = "reference", measured
    choices |= {role: _doubted(choice, copies) for role, choice in more.items()}
    if not more:
        rest, told = with_reference(own, rest)
        notes += told
        if told:
            more, kind, reference_of = drivers(rest, output.recorded, measured, ask)
            choices |= more
    if not more:
        more, idle = _idle(rest, output.recorded, ask)
        choices |= more
        others = [one for one in everything if all(one.one is not each.one for each in known)]
        notes += idle if more else [*idle, *notes_of_other_joints(output.recorded, others)]
    of_robot = bool(chosen.others)
    rotary, why = _rotary(choices if carried is None else {"output": output}, output.recorded, of_robot, ask)
    return Roles(choices, kind, _output_kind(measured), rotary, why, chosen, reference_of, tuple(notes))


def _is_clock(one: Recorded) -> bool:
    """Whether it is a time: a field that is named as one and increases, or a number that runs like a clock and has
    no word for a motion."""
    meaning = meaning_of(one)
    if meaning.certain or meaning.quantity in MEASURED:
        return False
    return is_time(one.said, one.value) or runs_like_a_clock(one)


def _of_other_side(one: Recorded, output: Recorded) -> bool:
    """Whether it is on the left where the output is on the right, or the reverse."""
    return one.side != output.side and "" not in (one.side, output.side)


def _voltage(one: Known, output: Recorded, measured: Quantity) -> Known:
    """A `v` that is not the velocity of the measured position, but is related to it, is a voltage."""
    if measured != "position" or not is_lone_v(one.one) or one.quantity != "velocity":
        return one
    if derivative(output, one.one)[0] > INTEGRAL or not goes_along(one.one, output):
        return one
    reason = "'v' is not the slope of the output, though it goes with it, so that it stands for a voltage"
    return replace(one, meaning=replace(one.meaning, quantity="effort", reason=reason))


def _without_copies(rest: list[Known], output: Recorded) -> tuple[list[Known], dict[int, float], list[str]]:
    """The numbers without copies of the output, the correlation of copies that are kept, by id, and notes on the others.

    A copy is kept if its name says that it drives or is commanded, and no other number's name does: a controller
    with a constant reference produces such an effort.
    """
    correlation = {id(one.one): copies_output(one.one, output) for one in rest}
    copies = [
        one for one in rest
        if correlation[id(one.one)] != 0.0 and (one.quantity == "effort" or not one.meaning.commanded)
    ]  # fmt: skip
    named = any(one.quantity == "effort" and one not in copies for one in rest)
    kept = [one for one in copies if one.quantity == "effort" and not named]
    notes = [note_of_copy(one.one, correlation[id(one.one)]) for one in copies if one not in kept]
    left = [one for one in rest if one not in copies or one in kept]
    return left, {id(one.one): correlation[id(one.one)] for one in kept}, notes


def _doubted(choice: Choice, copies: Mapping[int, float]) -> Choice:
    if id(choice.recorded) not in copies:
        return choice
    return replace(choice, doubts=(*choice.doubts, doubt_of_copy(copies[id(choice.recorded)])))


def _idle(rest: list[Known], output: Recorded, ask: Ask) -> tuple[dict[str, Choice], list[str]]:
    """The input that the user chooses where no driving signal is known; else a note on what is not used."""
    own = [one for one in rest if _is_elsewhere_of(one, output)]
    along = [(coherent(one.one, output), one) for one in rest if one in own or goes_along(one.one, output)]
    along.sort(key=lambda pair: (pair[1] not in own, -pair[0]))
    unknown = [one for one in rest if one.quantity is None and all(one is not each for _, each in along)]
    able = [*(one for _, one in along), *unknown]
    number = (
        ask("What drives the machine (input)?", ["nothing of these", *(str(one.one) for one in able)])
        if able
        else 0
    )
    if number > 0:
        return {"input": Choice(able[number - 1].one, "it was named when `rhythmid init` asked")}, []
    listed = "; ".join(
        f"{one.one} ({one.quantity or 'unknown'}: {one.meaning.reason or 'nothing says what it is'}; coherence {share:.2f})"
        for share, one in along
    )
    notes = (
        [
            f"nothing is taken to drive the machine, though this {'is of its joint or ' if own else ''}goes with the output: {listed}"
        ]
        if along
        else []
    )
    return {}, notes + ([note_of_unknown(unknown, output)] if unknown else [])


def _is_elsewhere_of(one: Known, output: Recorded) -> bool:
    """Whether its name refers to the output's joint, in another message."""
    joint = meaning_of(output).joint
    return bool(output.topic and joint) and one.meaning.joint == joint and one.one.topic != output.topic


def _output_kind(quantity: Quantity) -> OutputKind:
    return quantity if quantity != "effort" else "position"


def _without_empty_letters(known: list[Known]) -> list[Known]:
    """Single letters have no meaning where all of them would be one quantity, as V1 and V2."""
    quantities = {one.quantity for one in known}
    told = any(one.meaning.certain or one.one.side or says_who_asks(one.one) for one in known)
    if len(known) > 1 and len(quantities) == 1 and not told:
        return [replace(one, meaning=replace(one.meaning, quantity=None, commanded=None)) for one in known]
    return known


def _output(
    known: list[Known], ask: Ask, place: str, constant: Sequence[Recorded], joint: Joint
) -> tuple[Choice, list[Known]]:
    """The measured motion: a position before a velocity before an acceleration; of several, the one that goes to the
    set point among the constants, else the one that moves most."""
    for quantity in MEASURED:
        able = [
            one for one in known
            if one.quantity == quantity and one.meaning.commanded is not True and not one.meaning.forcing and not one.meaning.base
        ]  # fmt: skip
        if joint.requested:  # a motion of no joint, such as the motor's, only where it has none of its own
            able = [one for one in able if one.meaning.joint == joint.name] or able
        if able:
            steered = (
                gone_to_set_point(constant, joint, [one.one for one in able], quantity)
                if len(able) > 1
                else None
            )
            ranked = ranked_by_worth(
                [(np.inf if one.one is steered else _worth_as_output(one), one) for one in able]
            )
            best = pick("Which is the measured motion (output)?", ranked, ask)
            picked = ranked[best][1]
            reason = next(one.meaning.reason for one in able if one.one is picked)
            if picked is steered:
                reason += "; of those it comes nearest to the set point"
            elif len(able) > 1:
                reason += "; of those it moves most"
            others = tuple(one for _, one in ranked if one is not picked)
            doubt = doubt_of_letter(picked)
            return Choice(
                picked, f"a measured {quantity}: {reason}", others, (doubt,) if doubt else ()
            ), known
    able = [one for one in known if one.quantity in (None, "position") and not one.meaning.forcing]
    measured = [one for one in able if one.meaning.commanded is not True and not one.meaning.base]
    return output_by_data(measured or able, known, place)


def _worth_as_output(one: Known) -> float:
    """Score by the size of the motion. Numbers with more than a few values, named as measured, or named by a word
    come before the others."""
    moved = float(np.nanstd(one.one.value))
    moved *= 1e6 if shows_motion(one.one) else 1.0
    return moved * (1e3 if one.meaning.certain else 1.0) * (1e3 if one.meaning.commanded is False else 1.0)


def _velocity(output: Choice, measured: Quantity, rest: list[Known]) -> Choice | None:
    """The recorded velocity of which the output is the integral."""
    if measured != "position":
        return None
    able = [one for one in rest if one.quantity == "velocity" and one.meaning.commanded is not True]
    scored = [(derivative(output.recorded, one.one), one) for one in able]
    scored = [pair for pair in scored if pair[0][0] > INTEGRAL]
    if not scored:
        return None
    (r, ratio), best = max(scored, key=lambda pair: pair[0][0])
    doubts = ()
    if abs(ratio - 1.0) > RATIO:
        doubts = (
            f"the position's slope is {ratio:.4g} times this: one of them is in another unit ({_degrees(ratio)})",
        )
    return Choice(best.one, f"the output is its integral ({r:.3f} correlation)", doubts=doubts)


def _degrees(ratio: float) -> str:
    if abs(60.0 * abs(ratio) - 1.0) < PER_MINUTE:
        return "the position may be in turns and the velocity in turns a minute: scale: 6.283185307 and 0.1047197551"
    if 40.0 < ratio < 80.0:
        return "the position may be in degrees: scale: 0.0174532925"
    if 1 / 80.0 < ratio < 1 / 40.0:
        return "the velocity may be in degrees: scale: 0.0174532925"
    return "correct the scale"


def _rotary(choices: Mapping[str, Choice], output: Recorded, of_robot: bool, ask: Ask) -> tuple[bool, str]:
    """Whether the machine is rotational, by units and names; a joint of several, or of a JointState, is rotational
    by default."""
    for judge in (partial(rotary_of, by_topic=False), rotary_of_wrench, rotary_of):
        for choice in choices.values():
            rotary, why = judge(choice.recorded)
            if rotary is not None:
                return rotary, f"{choice.recorded}: {why}"
    turns = of_robot or output.type == "sensor_msgs/msg/JointState"
    answers = ["it turns (rad, N m)", "it slides (m, N)"]
    number = ask("Does the joint turn or slide?", answers if turns else answers[::-1])
    rotary = turns == (number == 0)
    return rotary, "no name or unit says it; most joints turn" if turns else UNTOLD
