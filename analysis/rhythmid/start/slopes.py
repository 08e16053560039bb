"""Numbers that are the derivative of a recorded position, whatever their names say."""

from collections.abc import Sequence

from rhythmid.start.meaning import words_of
from rhythmid.start.relation import RATIO, SURE_INTEGRAL, derivative
from rhythmid.start.role_choice import Known


def without_slopes(known: Sequence[Known]) -> list[Known]:
    """The numbers, with those taken for velocities that are clearly the derivative of a position, in consistent units.

    Only numbers whose names share a word with that of the position are compared: two axes in quadrature are also
    each other's derivatives.
    """
    able = [one for one in known if one.quantity == "position" and one.meaning.commanded is not True]
    found: dict[int, str] = {}
    for slope in able:
        for position in able:
            if slope is position or id(position) in found or not _alike(position, slope):
                continue
            r, ratio = derivative(position.one, slope.one)
            if r > SURE_INTEGRAL and abs(ratio - 1.0) < RATIO:
                found[id(slope)] = f"it is the derivative of {position.one} ({r:.2f} correlation)"
    return [one.taken_for("velocity", found[id(one)]) if id(one) in found else one for one in known]


def _alike(position: Known, slope: Known) -> bool:
    """Whether the name of a number is that of a position with further words, as angle_2 beside angle."""
    own, other = (set(words_of(one.one.said)) for one in (position, slope))
    same_source = position.one.topic == slope.one.topic and position.one.joint == slope.one.joint
    return same_source and own < other
