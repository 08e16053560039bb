"""Which recorded number plays which role: what drives the machine, what it answers, and what else helps; each with its reason."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cache

import numpy as np

from rhythmid.errors import InputError
from rhythmid.record.inventory import Inventory, Recorded
from rhythmid.record.signals import InputKind, OutputKind
from rhythmid.start.carried import carried_motion
from rhythmid.start.copies import correlation_of_copy, doubt_of_copy, note_of_copy
from rhythmid.start.joint import Joint, joint_of
from rhythmid.start.meaning import Meaning, Quantity, is_ignored, is_lone_v, meaning_of, poses, rotary_of
from rhythmid.start.relation import coherent, derivative, drives, follows, goes_along
from rhythmid.start.step_before import BEFORE, step_before

Ask = Callable[
    [str, Sequence[str]], int
]  # a question and its possible answers, the best first -> number of the answer
CLOSE = 0.7  # of the best candidate's worth, from which another one is worth a question
COPY = 0.9  # correlation with its command from which an answer is the same quantity
INTEGRAL = 0.9  # correlation from which a position and a velocity belong together
SURE_INTEGRAL = 0.98  # the same where no name says so
RATIO = 0.3  # by which the slope of a position may differ from the velocity, before their units are doubted
MEASURED: tuple[Quantity, ...] = ("position", "velocity", "acceleration")


@dataclass(frozen=True, eq=False)
class Choice:
    """What plays a role, why, what else might, and what is doubtful about it."""

    recorded: Recorded
    reason: str
    others: tuple[Recorded, ...] = ()
    doubts: tuple[str, ...] = ()


@dataclass(frozen=True, eq=False)
class Roles:
    """Roles by name as in signals.yaml, what the input and the output are, whether the machine turns, and what a user should know."""

    choices: Mapping[str, Choice]
    input_kind: InputKind
    output_kind: OutputKind
    rotary: bool
    rotary_reason: str
    joint: Joint
    reference_of: Quantity = "position"
    notes: tuple[str, ...] = field(default_factory=tuple)


@dataclass(frozen=True, eq=False)
class _Known:
    """A number with its meaning."""

    one: Recorded
    meaning: Meaning

    @property
    def quantity(self) -> Quantity | None:
        return self.meaning.quantity


def first_answer(question: str, answers: Sequence[str]) -> int:
    """Takes the best guess without asking."""
    return 0


def guess_roles(found: Inventory, joint: str | None = None, ask: Ask = first_answer) -> Roles:
    """Roles of what is in a source. Raises InputError where nothing can be the output, or no joint is called `joint`."""
    known = [_Known(one, meaning_of(one)) for one in found.recorded if not is_ignored(one)]
    known = _without_empty_letters(known)
    if not known:
        raise InputError(f"{found.path}: holds nothing that could be a motion")
    said = [(one.one, one.meaning) for one in known]
    carried = carried_motion(said) if joint is None else None
    chosen = joint_of(said, joint, ask, str(found.path)) if carried is None else Joint()
    known = [one for one in known if chosen.includes(one.one, one.meaning)]
    if carried is not None:
        output = Choice(carried.driven, f"a measured position: {carried.reason}", (carried.driver,))
    else:
        output, known = _output(known, ask, str(found.path))
    choices = {"output": output}
    measured = next(one for one in known if one.one is output.recorded).quantity or "position"
    rest = [one for one in known if one.one is not output.recorded]
    velocity = _velocity(output, measured, rest)
    if velocity is not None:
        choices["velocity"] = velocity
        rest = [one for one in rest if one.one is not velocity.recorded]
    rest = [_voltage(one, output.recorded, measured) for one in rest]
    rest, copies, notes = _without_copies(rest, output.recorded)
    rest = [_by_data(one, output.recorded, measured, velocity) for one in rest]
    more, kind, reference_of = _drivers(rest, output.recorded, measured, ask)
    if carried is not None:
        reason = f"a motion that drives {carried.driven}, and nothing else drives"
        more = {"input": Choice(carried.driver, reason, doubts=(carried.doubt,))}
    step = None if more else step_before(found.constant, chosen)
    if step is not None:
        more = {"input": Choice(step, "the only effort, and nothing else drives", doubts=(BEFORE,))}
    choices |= {role: _doubted(choice, copies) for role, choice in more.items()}
    if not more:
        notes += _idle(rest, output.recorded)
    rotary, why = _rotary(choices if carried is None else {"output": output}, output.recorded, ask)
    return Roles(choices, kind, _output_kind(measured), rotary, why, chosen, reference_of, tuple(notes))


def _voltage(one: _Known, output: Recorded, measured: Quantity) -> _Known:
    """A `v` that is not the velocity of the measured position, but has to do with it, is a voltage."""
    if measured != "position" or not is_lone_v(one.one) or one.quantity != "velocity":
        return one
    if derivative(output, one.one)[0] > INTEGRAL or not goes_along(one.one, output):
        return one
    reason = "'v' is not the slope of the output, though it goes with it, so that it stands for a voltage"
    return replace(one, meaning=replace(one.meaning, quantity="effort", reason=reason))


def _without_copies(rest: list[_Known], output: Recorded) -> tuple[list[_Known], dict[int, float], list[str]]:
    """What is left without copies of the output, the correlation of those that are kept, by id, and what to tell of the others.

    A copy is kept where its name says that it drives or is asked for, and nothing else that says so is there: a controller whose
    reference stands still makes such an effort.
    """
    correlation = {id(one.one): correlation_of_copy(one.one, output) for one in rest}
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


def _idle(rest: list[_Known], output: Recorded) -> list[str]:
    """What was left unused where nothing drives the machine, though it goes with the output."""
    told = [(coherent(one.one, output), one) for one in rest if goes_along(one.one, output)]
    told.sort(key=lambda pair: -pair[0])
    listed = "; ".join(
        f"{one.one} ({one.quantity or 'unknown'}: {one.meaning.reason or 'nothing says what it is'}; coherence {share:.2f})"
        for share, one in told
    )
    return (
        [f"nothing is taken to drive the machine, though this goes with the output: {listed}"] if told else []
    )


def _output_kind(quantity: Quantity) -> OutputKind:
    return quantity if quantity != "effort" else "position"


def _without_empty_letters(known: list[_Known]) -> list[_Known]:
    """Single letters tell nothing where all of them would be one quantity, as V1 and V2."""
    quantities = {one.quantity for one in known}
    if len(known) > 1 and len(quantities) == 1 and not any(one.meaning.certain for one in known):
        return [replace(one, meaning=replace(one.meaning, quantity=None, commanded=None)) for one in known]
    return known


def _pick(question: str, ranked: Sequence[tuple[float, Recorded]], ask: Ask) -> int:
    """The best of candidates in falling order of worth; asked for where others are close."""
    close = [one for worth, one in ranked if worth >= CLOSE * ranked[0][0]]
    return ask(question, [str(one) for one in close]) if len(close) > 1 else 0


def _ranked(scored: Sequence[tuple[float, _Known]]) -> list[tuple[float, Recorded]]:
    return [(worth, one.one) for worth, one in sorted(scored, key=lambda pair: -pair[0])]


def _output(known: list[_Known], ask: Ask, place: str) -> tuple[Choice, list[_Known]]:
    """The measured motion: a position before a velocity before an acceleration, the one that moves most."""
    for quantity in MEASURED:
        able = [
            one for one in known
            if one.quantity == quantity and one.meaning.commanded is not True and not one.meaning.forcing and not one.meaning.base
        ]  # fmt: skip
        if able:
            ranked = _ranked([(_worth_as_output(one), one) for one in able])
            best = _pick("Which is the measured motion (output)?", ranked, ask)
            picked = ranked[best][1]
            reason = next(one.meaning.reason for one in able if one.one is picked)
            if len(able) > 1:
                reason += "; of those it moves most"
            others = tuple(one for _, one in ranked if one is not picked)
            return Choice(picked, f"a measured {quantity}: {reason}", others), known
    return _output_by_data([one for one in known if one.quantity in (None, "position")], known, place)


def _worth_as_output(one: _Known) -> float:
    """How much it moves; what is said to be measured, or is called by a word, counts before what is not."""
    moved = float(np.nanstd(one.one.value))
    return moved * (1e3 if one.meaning.certain else 1.0) * (1e3 if one.meaning.commanded is False else 1.0)


def _output_by_data(able: list[_Known], known: list[_Known], place: str) -> tuple[Choice, list[_Known]]:
    """Where no name tells: the integral of another one, else what is driven more by the others than it drives them."""
    if not able:
        raise InputError(
            f"{place}: no position, velocity or acceleration is measured; write signals.yaml by hand"
        )
    for first in able:
        for second in able:
            if first is second:
                continue
            r, ratio = derivative(first.one, second.one)
            if r > SURE_INTEGRAL and abs(ratio - 1.0) < RATIO:
                choice = Choice(
                    first.one, f"no name says it; it is the integral of {second.one} ({r:.2f} correlation)"
                )
                changed = {id(first): "position", id(second): "velocity"}
                return choice, [_said(one, changed[id(one)]) if id(one) in changed else one for one in known]
    if len(able) == 1:
        return Choice(able[0].one, "the only number that is left"), [
            _said(one, "position") if one is able[0] else one for one in known
        ]

    @cache
    def lead(first: Recorded, second: Recorded) -> float:
        return drives(first, second) - drives(second, first)

    scored: list[tuple[float, _Known]] = []
    for one in able:
        others = [other for other in able if other is not one]
        scored.append((sum(lead(o.one, one.one) for o in others), one))
    (gain, best), *_ = sorted(scored, key=lambda pair: -pair[0])
    others = tuple(one.one for one in able if one is not best)
    doubts = ("no name says what it measures: set kind and unit",)
    choice = Choice(
        best.one, f"no name says it; the past of the others predicts it better than it predicts them ({gain:+.2f} in log variance)",
        others, doubts,
    )  # fmt: skip
    return choice, [_said(one, "position") if one is best else one for one in known]


def _said(one: _Known, quantity: Quantity | str) -> _Known:
    return replace(one, meaning=replace(one.meaning, quantity=quantity, reason="the data say so"))


def _velocity(output: Choice, measured: Quantity, rest: list[_Known]) -> Choice | None:
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
    if 40.0 < ratio < 80.0:
        return "the position may be in degrees: scale: 0.0174532925"
    if 1 / 80.0 < ratio < 1 / 40.0:
        return "the velocity may be in degrees: scale: 0.0174532925"
    return "correct the scale"


def _by_data(one: _Known, output: Recorded, measured: Quantity, velocity: Choice | None) -> _Known:
    """What a command without a quantity asks for: what it comes closest to."""
    if one.quantity is not None:
        return one
    targets: list[tuple[Quantity, Recorded]] = [(measured, output)]
    if velocity is not None:
        targets.append(("velocity", velocity.recorded))
    for quantity, answer in targets:
        told = follows(one.one, answer)
        if told.correlation > COPY and told.is_copy and told.lag >= 0.0:
            reason = f"the {quantity} follows it {1e3 * told.lag:.3g} ms later ({told.correlation:.2f} correlation)"
            return replace(
                one, meaning=replace(one.meaning, quantity=quantity, commanded=True, reason=reason)
            )
    if poses(one.one):
        told = follows(one.one, output)
        reason = f"a target of the {measured}, which follows it ({told.correlation:.2f} correlation)"
        return replace(one, meaning=replace(one.meaning, quantity=measured, commanded=True, reason=reason))
    coherence = coherent(one.one, output)
    reason = f"no motion is a copy of it, and it is coherent with the output (coherence {coherence:.2f})"
    return replace(one, meaning=replace(one.meaning, quantity="effort", reason=reason))


def _drivers(
    rest: list[_Known], output: Recorded, measured: Quantity, ask: Ask
) -> tuple[dict[str, Choice], InputKind, Quantity]:
    """What drives the machine: efforts commanded and measured, forcing, references, or the motion of its base."""
    efforts = [one for one in rest if one.quantity == "effort"]
    forcing = [one for one in efforts if one.meaning.forcing]
    efforts = [one for one in efforts if not one.meaning.forcing]
    commanded = [one for one in efforts if one.meaning.commanded]
    sensed = [one for one in efforts if not one.meaning.commanded]
    sensed = [
        one for one in sensed if one.meaning.certain
    ] or sensed  # what a name says before what may be anything
    if commanded and not forcing:  # a wrench beside a command is what pushes from outside
        forcing = [
            one for one in sensed if one.one.type.startswith("geometry_msgs/") and "Wrench" in one.one.type
        ]
        sensed = [one for one in sensed if one not in forcing]
    found: dict[str, Choice] = {}
    if forcing:
        found["forcing"] = _strongest(forcing, "moves most of what pushes from outside")
    reference, of = _reference(rest, output, measured)
    base = [one for one in rest if one.meaning.base and one.quantity in ("position", "acceleration")]
    if commanded:
        found["input"] = _driving(commanded, output, "an effort that was asked for", ask)
        if sensed:
            found["effort"] = _measured_effort(sensed, found["input"].recorded, output, ask)
    elif sensed and reference is not None:
        found["effort"] = _driving(sensed, output, "an effort that was measured", ask)
    elif sensed:
        found["input"] = _driving(sensed, output, "an effort, and nothing else drives", ask)
    elif base:
        found["input"] = _strongest(base, "the motion of the base")
        kind: InputKind = "base_displacement" if base[0].quantity == "position" else "base_acceleration"
        return found, kind, of
    if reference is not None and ("effort" in found or "input" not in found):
        if "input" in found or "effort" in found:
            found["reference"] = reference
        else:
            found["input"] = reference
            return found, "reference", of
    return found, "force", of


def _strongest(able: list[_Known], reason: str) -> Choice:
    ranked = sorted((one.one for one in able), key=lambda one: -float(np.nanstd(one.value)))
    return Choice(ranked[0], f"{reason}: {able[0].meaning.reason}", tuple(ranked[1:]))


def _driving(able: list[_Known], output: Recorded, reason: str, ask: Ask) -> Choice:
    """Of several efforts the one that goes best with the output."""
    if len(able) == 1:
        return Choice(able[0].one, f"{reason}: {able[0].meaning.reason}")
    ranked = _ranked([(coherent(one.one, output) + 1e-9, one) for one in able])
    picked = ranked[_pick("What drives the machine (input)?", ranked, ask)][1]
    why = next(one.meaning.reason for one in able if one.one is picked)
    others = tuple(one for _, one in ranked if one is not picked)
    return Choice(
        picked,
        f"{reason}: {why}; of those it goes best with the output (coherence {coherent(picked, output):.2f})",
        others,
    )


def _measured_effort(sensed: list[_Known], command: Recorded, output: Recorded, ask: Ask) -> Choice:
    choice = _driving(sensed, output, "an effort that was measured", ask)
    told = follows(command, choice.recorded)
    if told.correlation > COPY and not told.is_copy:
        doubt = f"it is {told.ratio:.3g} times the command: one of them is in another unit, or behind a gear"
        return replace(choice, doubts=(doubt,))
    return choice


def _reference(rest: list[_Known], output: Recorded, measured: Quantity) -> tuple[Choice | None, Quantity]:
    """The position, else the velocity, that was asked for: the one that the output follows best."""
    for quantity in ("position", "velocity"):
        able = [one for one in rest if one.meaning.commanded and one.quantity == quantity]
        if able and (quantity == measured or quantity == "velocity"):
            scored = [(abs(follows(one.one, output).correlation), one) for one in able]
            ranked = _ranked(scored)
            told = follows(ranked[0][1], output)
            why = next(one.meaning.reason for one in able if one.one is ranked[0][1])
            reason = f"a {quantity} that was asked for: {why}"
            if quantity == measured:
                reason += f"; the output follows it {1e3 * told.lag:.3g} ms later ({told.correlation:.2f} correlation)"
            return Choice(ranked[0][1], reason, tuple(one for _, one in ranked[1:])), quantity
    return None, "position"


def _rotary(choices: Mapping[str, Choice], output: Recorded, ask: Ask) -> tuple[bool, str]:
    """Whether the machine turns, as units and names say; a JointState's joint that says nothing turns."""
    for choice in choices.values():
        rotary, why = rotary_of(choice.recorded)
        if rotary is not None:
            return rotary, f"{choice.recorded}: {why}"
    turns = output.type == "sensor_msgs/msg/JointState"
    answers = ["it turns (rad, N m)", "it slides (m, N)"]
    number = ask("Does the joint turn or slide?", answers if turns else answers[::-1])
    rotary = turns == (number == 0)
    return rotary, "no name or unit says it; most joints turn" if turns else "no name or unit says it"
