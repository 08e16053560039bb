"""What was asked for of a measured motion where nothing else drives, and no name says it: another motion that it follows."""

from dataclasses import replace

from rhythmid.record.inventory import Recorded
from rhythmid.start.direction import may_be_one_motion
from rhythmid.start.known import Known
from rhythmid.start.relation import coherent, follows, predicts

FOLLOWS = (
    0.9  # coherence from which a linear servo makes the one of the other, however much later and smaller
)


def with_reference(own: Known, rest: list[Known]) -> tuple[list[Known], list[str]]:
    """What is known beside the output, with the motion that leads it as what was asked for, and a note on it; as it is where none does.

    The output is called measured, and the other one is not. Then it need not be a copy: its servo may be slow, or it seldom sampled.
    """
    if own.meaning.commanded is not False:
        return rest, []
    able = [(coherent(one.one, own.one), one) for one in rest if may_be_one_motion(own, one)]
    able = [(share, one) for share, one in able if share >= FOLLOWS and _leads(one.one, own.one)]
    if not able:
        return rest, []
    share, first = max(able, key=lambda pair: pair[0])
    reason = f"the output goes with it and comes later (coherence {share:.2f})"
    asked = replace(first, meaning=replace(first.meaning, commanded=True, reason=reason))
    note = (
        f"no name says that {first.one} was asked for; it is taken for the reference, because {own.one} is called measured and follows it: "
        "if it is another sensor, delete it"
    )
    return [asked if one is first else one for one in rest], [note]


def _leads(first: Recorded, second: Recorded) -> bool:
    """Whether the second comes later, is of the first one's size, and is told by its past better than the other way about."""
    told = follows(first, second)
    return told.lag > 0.0 and told.is_copy and predicts(first, second) > predicts(second, first)
