"""Meaning of a number whose name does not state it, from its relations to the other numbers: integral, lag and
coherence."""

from collections.abc import Sequence
from functools import cache

import numpy as np

from rhythmid.record.inventory import Recorded
from rhythmid.record.output_copy import SAME, doubt_of_copy
from rhythmid.start.carried import surely_drives
from rhythmid.start.copies import is_second_sensor
from rhythmid.start.direction import COPY
from rhythmid.start.meaning import (
    differ_in_number,
    is_counted,
    is_no_effort,
    letter_of,
    meaning_of,
    of_one_array,
    poses,
    says_that_it_drives,
)
from rhythmid.start.no_motion import NoMotionError, no_motion
from rhythmid.start.relation import (
    GOES_ALONG,
    HARDLY,
    Follows,
    coherent,
    drives,
    follows,
    integrals,
    predicts,
)
from rhythmid.start.role_choice import Choice, Known
from rhythmid.start.vocabulary import Quantity

OR_ELSE = "a base that moves is  kind: base_displacement, what a controller is asked for  kind: reference"
NAMED = 8  # largest number of numbers in a note


def output_by_data(able: list[Known], known: list[Known], place: str) -> tuple[Choice, list[Known]]:
    """The output where no name states it: the integral of another number, else the number that the others drive
    more than it drives them."""
    if not able and len(known) == 1 and known[0].meaning.commanded is not True:
        doubts = ("its unit is none of a motion: set kind, unit and scale",)
        return Choice(known[0].one, "the only number that was recorded", (), doubts), [
            known[0].taken_for("position")
        ]
    if not able:
        raise NoMotionError(f"{place}: {no_motion(known)}")
    if pairs := integrals([one.one for one in able]):
        motion, slope, r = max(pairs, key=lambda pair: float(np.nanstd(pair[0].value)))
        choice = Choice(motion, f"no name says it; it is the integral of {slope} ({r:.2f} correlation)")
        changed: dict[int, Quantity] = {id(motion): "position", id(slope): "velocity"}
        return choice, [
            one.taken_for(changed[id(one.one)]) if id(one.one) in changed else one for one in known
        ]
    if len(able) == 1:
        return Choice(able[0].one, "the only number that is left"), [
            one.taken_for("position") if one is able[0] else one for one in known
        ]

    @cache
    def lead(first: Recorded, second: Recorded) -> float:
        return drives(first, second) - drives(second, first)

    scored: list[tuple[float, Known]] = []
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
    return choice, [one.taken_for("position") if one is best else one for one in known]


def by_data(one: Known, output: Recorded, measured: Quantity, velocity: Choice | None) -> Known:
    """The quantity of a command whose name does not state it: that of the closest motion."""
    table = velocity is not None and of_one_array(velocity.recorded, output)  # of several quantities
    if one.quantity is not None or is_counted(one.one) or (of_one_array(one.one, output) and not table):
        return one
    targets: list[tuple[Quantity, Recorded]] = [(measured, output)]
    if velocity is not None:
        targets.append(("velocity", velocity.recorded))
    for quantity, answer in targets:
        told = follows(one.one, answer)
        if told.correlation > COPY and told.is_copy and _leads(one, answer, told):
            when = f"{1e3 * told.lag:.3g} ms later" if told.lag else "at once"
            reason = f"the {quantity} follows it {when} ({told.correlation:.2f} correlation)"
            return one.taken_for(quantity, reason, commanded=True)
    if poses(one.one):
        told = follows(one.one, output)
        reason = f"a target of the {measured}, which follows it ({told.correlation:.2f} correlation)"
        return one.taken_for(measured, reason, commanded=True)
    if one.meaning.base:
        return one.taken_for("position", "its name says that it is one of the base")
    if is_no_effort(one.one):
        return one
    if one.meaning.commanded or says_that_it_drives(one.one):
        return one.taken_for("effort", _coherence(one, output))
    for quantity, answer in targets:
        told = follows(one.one, answer)
        if is_second_sensor(one.one, answer, told):
            when = f"{-1e3 * told.lag:.3g} ms after it" if told.lag < 0.0 else "at once"
            reason = f"a copy of {answer} ({told.correlation:.2f} correlation, {when})"
            return one.taken_for(quantity, reason, commanded=False)
    return _driver(one, output)


def _leads(one: Known, answer: Recorded, told: Follows) -> bool:
    """Whether the answer is later. An answer without lag counts if a name says so, or if only the command's past
    predicts it."""
    if told.lag != 0.0 or one.meaning.commanded:
        return told.lag >= 0.0
    return surely_drives(one.one, answer, predicts(one.one, answer), predicts(answer, one.one))


def _driver(one: Known, output: Recorded) -> Known:
    """The number as a driving signal, where its name, its coherence with the output or its past supports that; else
    unchanged."""
    letter = meaning_of(one.one).quantity
    if letter == "position" and differ_in_number(one.one, output):
        return one  # a second joint or sensor
    there, back = predicts(one.one, output), predicts(output, one.one)
    share = coherent(one.one, output)
    if share < GOES_ALONG and surely_drives(one.one, output, there, back):
        reason = f"its past predicts the output ({there:.3g} times as well as chance does; in the other direction {back:.2g} times)"
    elif share >= HARDLY:
        reason = _coherence(one, output)
    else:
        return one
    if letter == "position" and letter_of(one.one) == letter_of(output):
        return one.taken_for("position", f"a motion that goes with the output: {reason}").of_base()
    told = follows(one.one, output)
    if told.lag == 0.0 and abs(told.correlation) > SAME:
        doubt = f"no name says that it drives, and {doubt_of_copy(told.correlation)}"
    elif share < GOES_ALONG:
        doubt = (
            f"no name says that it drives, and its coherence with the output is {share:.2f} only: {OR_ELSE}"
        )
    else:
        doubt = ""
    return one.taken_for("effort", reason).doubted(doubt)


def _coherence(one: Known, output: Recorded) -> str:
    share = coherent(one.one, output)
    return f"nothing says that it is a motion, and it is coherent with the output (coherence {share:.2f})"


def note_of_unknown(unknown: Sequence[Known], output: Recorded) -> str:
    """Note on numbers that neither a name nor the data identify as driving signals, where there is no other driving
    signal."""
    told = sorted(((coherent(one.one, output), one) for one in unknown), key=lambda pair: -pair[0])
    listed = "; ".join(f"{one.one} (coherence {share:.2f})" for share, one in told[:NAMED])
    more = f" and {len(told) - NAMED} more" if len(told) > NAMED else ""
    return (
        f"nothing is taken to drive the machine: no name says what these are, and they hardly go with the output: {listed}{more}; "
        f"make the input of what drives; {OR_ELSE}"
    )
