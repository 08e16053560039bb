"""Assigns roles to recorded numbers: driving signal, output and further signals, each with its reason."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial

from rhythmid.record.inventory import Inventory, Recorded
from rhythmid.record.output_copy import doubt_of_copy
from rhythmid.record.signals import InputKind, OutputKind
from rhythmid.start.by_data import by_data, note_of_unknown
from rhythmid.start.copies import copies_output, note_of_copy, note_of_sensor
from rhythmid.start.direction import notes_of_other_joints
from rhythmid.start.drivers import drivers
from rhythmid.start.joint import Joint
from rhythmid.start.meaning import is_lone_v, meaning_of
from rhythmid.start.measured_motion import Motion, measured_motion, numbers
from rhythmid.start.relation import RATIO, coherent, derivative, goes_along
from rhythmid.start.role_choice import Ask, Choice, Known
from rhythmid.start.rotary import rotary_of, rotary_of_wrench
from rhythmid.start.stated import DRIVES
from rhythmid.start.step_before import BEFORE, duty_before, set_point_before, step_before
from rhythmid.start.unnamed_reference import with_reference
from rhythmid.start.unsigned_effort import without_unsigned
from rhythmid.start.vocabulary import Quantity

INTEGRAL = 0.9  # correlation above which a position and a velocity belong together
PER_MINUTE = 0.02  # by which a ratio of one to sixty may be off: that of degrees is 5 % off
UNTOLD = "no name or unit says it; where it turns, say so with units of rad and N*m"


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
    known, resting, twice = numbers(found)
    motion = measured_motion(found, known, resting, joint, ask)
    beside = _beside(motion)
    driven = _driven(found, motion, beside, stepped, ask)
    choices = {"output": motion.output, **beside.choices, **driven.choices}
    turning = choices if motion.carried is None else {"output": motion.output}
    rotary, why = _rotary(turning, motion.output.recorded, bool(motion.joint.others), ask)
    notes = (*twice, *motion.notes, *beside.notes, *driven.notes)
    kind = _output_kind(motion.quantity)
    return Roles(choices, driven.kind, kind, rotary, why, motion.joint, driven.reference_of, notes)


@dataclass(frozen=True, eq=False)
class _Beside:
    """The numbers beside the output that may drive, the correlation of copies of the output by id, the velocity, and notes."""

    rest: list[Known]
    copies: Mapping[int, float]
    choices: dict[str, Choice]
    notes: tuple[str, ...]


def _beside(motion: Motion) -> _Beside:
    """Sort the numbers beside the output: its velocity, its copies, and what may drive."""
    output, measured = motion.output.recorded, motion.quantity
    rest = [one for one in motion.known if one.one is not output and not _of_other_side(one.one, output)]
    velocity = _velocity(motion.output, measured, rest)
    if velocity is not None:
        rest = [one for one in rest if one.one is not velocity.recorded]
    rest = [_voltage(one, output, measured) for one in rest]
    rest, copies, notes = _without_copies(rest, output)
    rest, told = without_unsigned(rest, output, measured)
    told_by_data = [(one, by_data(one, output, measured, velocity)) for one in rest]
    sensors = [
        note_of_sensor(now) for was, now in told_by_data if was is not now and now.meaning.commanded is False
    ]
    choices = {} if velocity is None else {"velocity": velocity}
    return _Beside([now for _, now in told_by_data], copies, choices, (*notes, *told, *sensors))


@dataclass(frozen=True, eq=False)
class _Driven:
    """What drives the machine, the kind of the input, the quantity of which it is the reference, and notes."""

    choices: dict[str, Choice]
    kind: InputKind
    reference_of: Quantity
    notes: tuple[str, ...] = ()


def _driven(found: Inventory, motion: Motion, beside: _Beside, stepped: Collection[str], ask: Ask) -> _Driven:
    """What drives the machine: as stated, by its name, by what was set before the record, or as the user answers."""
    output, measured = motion.output.recorded, motion.quantity
    stated = [Known(one.one, meaning_of(one.one)) for one in motion.known if one.one.stated in DRIVES]
    if stated:
        rest = [one if one.quantity else one.taken_for(measured, one.meaning.reason) for one in stated]
        return _Driven(*drivers(rest, output, measured, ask))
    if motion.carried is not None:
        carried = motion.carried
        reason = f"a motion that drives {carried.driven}, and nothing else drives"
        return _Driven(
            {"input": Choice(carried.driver, reason, doubts=(carried.doubt,))},
            *drivers(beside.rest, output, measured, ask)[1:],
        )
    named, kind, reference_of = drivers(beside.rest, output, measured, ask)
    named = _set_before(found, motion, named, kind, stepped)
    if named:
        doubted = {role: _doubted(choice, beside.copies) for role, choice in named.items()}
        return _Driven(doubted, kind, reference_of)
    if (asked := set_point_before(found.constant, motion.joint, output, measured)) is not None:
        reason = f"a {measured} that was asked for, to which the output goes, and nothing else drives"
        return _Driven({"input": Choice(asked, reason, doubts=(BEFORE,))}, "reference", measured)
    return _unnamed(motion, beside, ask)


def _set_before(
    found: Inventory, motion: Motion, named: dict[str, Choice], kind: InputKind, stepped: Collection[str]
) -> dict[str, Choice]:
    """The drivers by their names, or a constant one that acts from the first sample on: where nothing else drives, and where a measured
    effort is that of a motor that starts from rest."""
    if not named:
        step = step_before(found.constant, motion.joint, stepped)
        named = named if step is None else {"input": Choice(*step, doubts=(BEFORE,))}
    only = named.get("input") if len(named) == 1 and kind == "force" else None
    if only is None or meaning_of(only.recorded).commanded is True:
        return named
    duty = duty_before(found.constant, motion.joint, motion.output.recorded, motion.quantity)
    if duty in (None, only.recorded):
        return named
    reason = f"it feeds a motor from the first sample on, and the machine starts from rest; {only.recorded} was measured"
    return {"input": Choice(duty, reason, (only.recorded, *only.others), (BEFORE,))}


def _unnamed(motion: Motion, beside: _Beside, ask: Ask) -> _Driven:
    """A reference that a measured motion follows, though no name says so; else what the user answers."""
    output, measured = motion.output.recorded, motion.quantity
    rest, told = with_reference(motion.own, beside.rest)
    choices, kind, reference_of = drivers(rest, output, measured, ask)
    if told and choices:
        return _Driven(choices, kind, reference_of, tuple(told))
    choices, idle = _idle(rest, output, ask)
    others = [one for one in motion.everything if all(one.one is not each.one for each in motion.known)]
    elsewhere = [] if choices else notes_of_other_joints(output, others)
    return _Driven(choices, kind, reference_of, (*told, *idle, *elsewhere))


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
