"""Numbers that are the derivative of a recorded position, or the integral of a recorded velocity, whatever their names say."""

from collections.abc import Sequence
from dataclasses import replace

from rhythmid.start.relation import RATIO, SURE_INTEGRAL, derivative
from rhythmid.start.role_choice import Known
from rhythmid.start.words import words_of


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


def with_integrals(known: Sequence[Known]) -> list[Known]:
    """The numbers, with those without a meaning taken for positions that are clearly the integral of a velocity, in
    consistent units: `D` beside `V`. Two axes in quadrature are each other's integrals in no such unit as a rule."""
    slopes = [one for one in known if one.quantity == "velocity" and one.meaning.commanded is not True]
    return [
        _integral(one, slopes) if one.quantity is None and not one.meaning.commanded else one for one in known
    ]


def _integral(one: Known, slopes: Sequence[Known]) -> Known:
    for slope in slopes:
        r, ratio = derivative(one.one, slope.one)
        if r > SURE_INTEGRAL and abs(ratio - 1.0) < RATIO:
            found = one.taken_for("position", f"it is the integral of {slope.one} ({r:.2f} correlation)")
            return replace(found, meaning=replace(found.meaning, certain=True))
    return one


def _alike(position: Known, slope: Known) -> bool:
    """Whether the name of a number is that of a position with further words, as angle_2 beside angle."""
    own, other = (set(words_of(one.one.said)) for one in (position, slope))
    same_source = position.one.topic == slope.one.topic and position.one.joint == slope.one.joint
    return same_source and own < other
