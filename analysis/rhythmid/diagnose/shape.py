"""Shape of a fitted effect: whether it still acts as its name says.

An effect at a bound of its parameters is about to become another effect.
"""

import math
from collections.abc import Sequence

from rhythmid.diagnose.size_error import departure
from rhythmid.elements.element import Scales
from rhythmid.elements.first_guess import NoGuess
from rhythmid.model import Model, Term


def shape_of(model: Model, added: Sequence[str], sizes: Scales) -> dict[str, float]:
    """The smallest statistic of the effects with the labels `added`, by the name of the rule that uses it."""
    terms = [term for label in added if (term := model.term(label)) is not None]
    return {"within_bounds": min(within_bounds(term, sizes) for term in terms)} if terms else {}


def within_bounds(term: Term, sizes: Scales) -> float:
    """Smallest distance of a free parameter from a bound set by the element's `ranges`, as a share of that bound.

    Also the distance of its size from that of no effect, as a share of the smallest first guess: an effect without a size is the
    hypothesis without it.
    """
    least = _size(term, sizes)
    for name in term.element.ranges(sizes) if term.element.ranges is not None else ():
        if term.values[name].fixed:
            continue
        value = term.values[name].value
        ends = [end for end in term.values[name].bounds if math.isfinite(end) and end != 0.0]
        least = min([least, *(abs(value - end) / abs(end) for end in ends)])
    return least


def _size(term: Term, sizes: Scales) -> float:
    """Size of an effect, as a share of the smallest first guess; infinite for one whose size has no first guess or is no free parameter."""
    element = term.element
    name, absent = element.size, element.absent
    if not name or not math.isfinite(absent) or term.values[name].fixed:
        return math.inf
    try:
        guesses = [abs(start[name] - absent) for start in element.first_guesses(sizes) if name in start]
    except NoGuess:
        return math.inf
    usual = min((one for one in guesses if one > 0.0), default=0.0)
    return departure(term) / usual if usual > 0.0 else math.inf
