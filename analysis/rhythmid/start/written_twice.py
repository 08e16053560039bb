"""Numbers that were recorded twice: the counts of a sensor beside its angle, or the duty of a bridge in per cent and
in counts. They are one number, so that one of them is enough."""

from collections.abc import Sequence

from rhythmid.start.copies import copies_output
from rhythmid.start.meaning import differ_in_number, force_unit_of, tells_unit
from rhythmid.start.relation import RATIO, follows
from rhythmid.start.role_choice import Known


def written_once(known: Sequence[Known]) -> tuple[list[Known], list[str]]:
    """The numbers without second writings, and a note on each of those.

    Of a motion the number whose unit is stated is kept; sizes in different units cannot be compared, so that counts
    would always move most. Of an effort without a stated unit the first is kept.
    """
    kept, notes = list(known), []
    for place, one in enumerate(known):
        before = {id(other) for other in known[:place]}
        first = next(
            (other for other in kept if other is not one and _is_second(one, other, id(other) in before)),
            None,
        )
        if first is not None:
            kept = [other for other in kept if other is not one]
            notes.append(f"{one.one} is {first.one} in another unit, and is left out")
    return kept, notes


def _is_second(one: Known, other: Known, after: bool) -> bool:
    """Whether a number, recorded `after` another one, is that one in a unit that nothing states."""
    if one.quantity is None or one.quantity != other.quantity or tells_unit(one.one):
        return False
    if one.one.side != other.one.side or differ_in_number(one.one, other.one):
        return False  # of two machines that are asked for the same
    of_effort = one.quantity == "effort"
    told = tells_unit(other.one) or (of_effort and after and force_unit_of(one.one) != "")
    of_one_unit = force_unit_of(one.one) in ("", force_unit_of(other.one))
    of_one_side = (one.meaning.commanded is True) == (other.meaning.commanded is True)
    alike = of_one_unit if of_effort else of_one_side
    if not told or not alike or copies_output(one.one, other.one) == 0.0:
        return False
    # an effort of the same size is the command as it was measured, or the reverse
    return not of_effort or abs(abs(follows(one.one, other.one).ratio) - 1.0) > RATIO
