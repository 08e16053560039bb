"""Which of two copies of one motion leads: the command is earlier than the measurement."""

from dataclasses import replace

from rhythmid.record.inventory import Recorded
from rhythmid.start.meaning import names_a_place
from rhythmid.start.relation import Follows, follows, predicts
from rhythmid.start.role_choice import Choice, Known
from rhythmid.start.words import words_of

COPY = 0.9  # correlation with its command above which an answer is the same quantity
LEAST_LAG = 2.5  # samples: two sensors of one motion may be that far apart because of filters and buses
AGAINST = 4.0  # ratio of evidence for the opposite direction above which it contradicts the lag
AXES = frozenset("x y z".split())  # motions of one body in several directions, however similar


def leads(first: Recorded, second: Recorded) -> Follows | None:
    """How the second follows the first, where it is a later copy and its past does not predict the first better;
    else None."""
    told = follows(first, second)
    if told.correlation < COPY or not told.is_copy or told.lag * min(first.rate, second.rate) < LEAST_LAG:
        return None
    return None if predicts(second, first) > AGAINST * max(predicts(first, second), 1.0) else told


def by_direction(output: Choice, known: list[Known]) -> tuple[Choice, list[Known], list[str]]:
    """The output, the known numbers, and notes, where another channel of the same quantity leads or follows the
    output as a copy.

    The earlier one was commanded, the later one measured, unless a name says otherwise. Three kinds are left
    unchanged: motions of other joints, motions at other locations (a motor leads its load), and axes of one body.
    """
    own = next(one for one in known if one.one is output.recorded)
    able = [one for one in known if one is not own and may_be_one_motion(own, one)]
    leading = [(told.correlation, told, one) for one in able if (told := leads(one.one, own.one)) is not None]
    if leading:
        _, told, first = max(leading, key=lambda each: each[0])
        return output, _asked_for(first, known, told), [_note(first.one, own.one, told)]
    if own.meaning.commanded is not None:
        return output, known, []
    following = [
        (told.correlation, told, one) for one in able if (told := leads(own.one, one.one)) is not None
    ]
    if not following:
        return output, known, []
    _, told, last = max(following, key=lambda each: each[0])
    reason = f"a measured {last.quantity}: {last.meaning.reason}; it follows {own.one} {1e3 * told.lag:.3g} ms later"
    others = tuple(one for one in output.others if one is not last.one)
    return Choice(last.one, reason, others), _asked_for(own, known, told), [_note(own.one, last.one, told)]


def may_be_one_motion(own: Known, other: Known) -> bool:
    """Whether no name says which of the two was commanded, and they may be one motion."""
    meaning = other.meaning
    if other.quantity != own.quantity or meaning.commanded is not None or meaning.forcing or meaning.base:
        return False
    if names_a_place(own.one) or names_a_place(other.one):
        return False
    axes = {words_of(one.one.said)[-1:] == [axis] for one in (own, other) for axis in AXES}
    joints = {meaning.joint, own.meaning.joint} - {""}
    return len(joints) < 2 and not axes >= {True}


def _asked_for(first: Known, known: list[Known], told: Follows) -> list[Known]:
    """The known numbers, with `first` as the command."""
    reason = f"it leads the output by {1e3 * told.lag:.3g} ms ({told.correlation:.2f} correlation)"
    asked = replace(first, meaning=replace(first.meaning, commanded=True, reason=reason))
    return [asked if one is first else one for one in known]


def _note(first: Recorded, last: Recorded, told: Follows) -> str:
    return (
        f"no name says whether {first} or {last} was asked for; {first} is taken for the reference, because it leads by "
        f"{1e3 * told.lag:.3g} ms: if it is another sensor, delete it"
    )


def doubt_of_direction(reference: Recorded, output: Recorded) -> str:
    """Doubt about a reference, by its name, that lags the output; empty where it does not."""
    told = leads(output, reference)
    if told is None:
        return ""
    return (
        f"it comes {1e3 * told.lag:.3g} ms after the output, which is a copy of it ({told.correlation:.2f} correlation): "
        "are the two exchanged, or their clocks apart?"
    )


def notes_of_other_joints(output: Recorded, others: list[Known]) -> list[str]:
    """Notes on motions of other joints, by their names, that lead or follow the output like a reference and its
    answer."""
    pairs = [pair for one in others for pair in ((one.one, output), (output, one.one))]
    told = [(first, last, found) for first, last in pairs if (found := leads(first, last)) is not None]
    return [
        f"{first} leads {last} by {1e3 * found.lag:.3g} ms ({found.correlation:.2f} correlation): where it was asked for, it is the reference"
        for first, last, found in told
    ]
