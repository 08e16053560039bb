"""Reference of a measured motion where there is no other driving signal and no name states it: another motion that
it follows."""

from dataclasses import replace

from rhythmid.record.inventory import Recorded
from rhythmid.start.direction import may_be_one_motion
from rhythmid.start.relation import coherent, follows, predicts
from rhythmid.start.role_choice import Known

FOLLOWS = 0.9  # coherence above which a linear servo generates one from the other, with any lag and gain


def with_reference(own: Known, rest: list[Known]) -> tuple[list[Known], list[str]]:
    """The known numbers beside the output, with the motion that leads it as the command, and a note on it;
    unchanged where there is none.

    The output is named as measured, and the other number is not. Then it need not be a copy: the servo may be slow,
    or the output sampled at a low rate.
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
    """Whether the second is later, has the size of the first, and is predicted by its past better than the reverse."""
    told = follows(first, second)
    return told.lag > 0.0 and told.is_copy and predicts(first, second) > predicts(second, first)
