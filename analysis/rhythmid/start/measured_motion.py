"""The measured motion of a source: which of its numbers may have a role, the joint, and the output."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from rhythmid.errors import InputError
from rhythmid.record.inventory import Inventory, Recorded
from rhythmid.record.table_clock import is_time
from rhythmid.start.by_data import output_by_data
from rhythmid.start.carried import Carried, carried_motion
from rhythmid.start.direction import by_direction
from rhythmid.start.joint import Joint, joint_of, shows_motion
from rhythmid.start.meaning import doubt_of_letter, is_ignored, meaning_of, says_who_asks
from rhythmid.start.poses import with_joint_positions
from rhythmid.start.relation import runs_like_a_clock
from rhythmid.start.role_choice import Ask, Choice, Known, pick, ranked_by_worth
from rhythmid.start.slopes import with_integrals, without_slopes
from rhythmid.start.step_before import gone_to_set_point
from rhythmid.start.symbols import with_symbols
from rhythmid.start.targets import with_targets
from rhythmid.start.unnamed_joints import column_groups
from rhythmid.start.vocabulary import Quantity
from rhythmid.start.written_twice import written_once

MEASURED: tuple[Quantity, ...] = ("position", "velocity", "acceleration")


def numbers(found: Inventory) -> tuple[list[Known], list[Known], list[str]]:
    """The numbers of a source that may have a role, those that never change, and notes on what is written twice. Raises
    InputError where there are none."""
    known = [
        Known(one, meaning_of(one))
        for one in found.recorded
        if one.stated is None and not is_ignored(one) and not _is_clock(one)
    ]
    known, twice = written_once(
        without_slopes(with_symbols(_without_empty_letters(with_joint_positions(known))))
    )
    known += [Known(one, meaning_of(one)) for one in found.recorded if one.stated is not None]
    everything = [*known, *(Known(one, meaning_of(one)) for one in found.constant)]
    known, resting = (with_targets(part, everything) for part in (known, everything[len(known) :]))
    known = with_integrals(known)
    if not known:
        raise InputError(f"{found.path}: holds nothing that could be a motion")
    if (groups := column_groups(found)) is not None:
        known, resting = ([groups.told(one) for one in part] for part in (known, resting))
    return known, resting, twice


@dataclass(frozen=True, eq=False)
class Motion:
    """The measured motion: its joint, the numbers of that joint and those of all, the choice, what carries the machine where its own
    motion is driven by another one, and notes."""

    joint: Joint
    known: list[Known]
    everything: list[Known]
    output: Choice
    carried: Carried | None = None
    notes: tuple[str, ...] = ()

    @property
    def own(self) -> Known:
        """The number of the output."""
        return next(one for one in self.known if one.one is self.output.recorded)

    @property
    def quantity(self) -> Quantity:
        """The quantity that is measured."""
        return self.own.quantity or "position"


def measured_motion(
    found: Inventory, known: list[Known], resting: list[Known], joint: str | None, ask: Ask
) -> Motion:
    """The output that is stated, that which another motion carries, or that which is the best guess."""
    stated = next((one for one in known if one.one.stated == "output"), None)
    joint = joint if stated is None else stated.meaning.joint or None
    said, still = ([(one.one, one.meaning) for one in part] for part in (known, resting))
    guessed = all(one.one.stated is None for one in known)
    carried = carried_motion(said) if joint is None and guessed else None
    unnamed = carried is not None or (stated is not None and joint is None)
    chosen = Joint() if unnamed else joint_of(said, still, joint, ask, str(found.path))
    own = [one for one in known if one.one.stated is not None or chosen.includes(one.one, one.meaning)]
    if carried is not None:
        output = Choice(carried.driven, f"a measured position: {carried.reason}", (carried.driver,))
        return Motion(chosen, own, known, output, carried)
    if stated is not None:
        output = Choice(stated.one, f"a measured {stated.quantity}: {stated.meaning.reason}")
        return Motion(chosen, own, known, output)
    output, own = _output(own, ask, str(found.path), found.constant, chosen)
    output, own, exchanged = by_direction(output, own)
    return Motion(chosen, own, known, output, notes=tuple(exchanged))


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


def _without_empty_letters(known: list[Known]) -> list[Known]:
    """Single letters have no meaning where all of them would be one quantity, as V1 and V2."""
    quantities = {one.quantity for one in known}
    told = any(one.meaning.certain or one.one.side or says_who_asks(one.one) for one in known)
    if len(known) > 1 and len(quantities) == 1 and not told:
        return [replace(one, meaning=replace(one.meaning, quantity=None, commanded=None)) for one in known]
    return known


def _is_clock(one: Recorded) -> bool:
    """Whether it is a time: a field that is named as one and increases, or a number that runs like a clock and has
    no word for a motion."""
    meaning = meaning_of(one)
    if meaning.certain or meaning.quantity in MEASURED:
        return False
    return is_time(one.said, one.value) or runs_like_a_clock(one)
