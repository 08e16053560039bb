"""Related laws: laws of one family, or of which one is a special case of the other."""

from collections.abc import Callable, Sequence

from rhythmid.diagnose.effort.candidate import Screened
from rhythmid.diagnose.effort.fitted import Fitted
from rhythmid.diagnose.hypothesis import Hypothesis, special_case
from rhythmid.diagnose.rejections import Claim, replaces
from rhythmid.elements.element import Element
from rhythmid.model import Model

REFINED = 10  # additions that are refitted in each round: the right one was always among the first five of a score test


def kin(first: Element, second: Element) -> bool:
    """Whether two elements are related laws."""
    if first.name == second.name and first.repeats:
        return False
    return (first.family != "" and first.family == second.family) or contained(first, second)


def contained(first: Element, second: Element) -> bool:
    """Whether two elements are the same or one is a special case of the other, so that one of them covers both."""
    return (
        first.name == second.name
        or second.name in first.special_case_of
        or first.name in second.special_case_of
    )


def shortlist(screened: Sequence[Screened]) -> list[Screened]:
    """The additions to be refitted: the best of the score test, all laws related to the best, freed values, the delay."""
    best = [one for one in screened if one.start.element is not None and one.gain > 0.0]
    chosen = best[:REFINED]
    if best:
        first = best[0].start.element
        assert first is not None
        chosen += [one for one in best[REFINED:] if one.start.element and kin(one.start.element, first)]
    return chosen + [one for one in screened if one.start.element is None]


def at_values_of(rich: Fitted, plain: Fitted) -> Model | None:
    """The model of hypothesis `plain` at the values of `rich`, whose last law contains its own; None where it does not."""
    label, other = plain.elements[-1], rich.elements[-1]
    term, wider = plain.fit.model.term(label), rich.fit.model.term(other)
    if term is None or wider is None or plain.elements[:-1] != rich.elements[:-1]:
        return None
    if wider.element.name not in term.element.special_case_of:
        return None
    known = rich.fit.model.parameters
    ends = {
        name: name.replace(label, other, 1) if name.startswith(f"{label}.") else name
        for name in plain.fit.names
    }
    return plain.fit.model.with_values({name: known[end].value for name, end in ends.items() if end in known})


def represented(
    claimed: Sequence[Hypothesis],
    order: Sequence[int],
    claim: Callable[[int, Hypothesis, Hypothesis], Claim],
) -> int:
    """Index of the hypothesis that represents the best of `order`, sorted by prediction, and its related laws.

    It is the simplest one that no richer law replaces: neither the best one nor another. `claim(index, without, simpler)` is a hypothesis
    with those that it is compared with.
    """
    best = order[0]
    for index in order[1:]:
        plain = claimed[index]
        if special_case(plain, claimed[best]) and not replaces(claim(best, plain, plain)):
            best = index
    plain = claimed[best]
    richer = (index for index in order if special_case(plain, claimed[index]))
    return next((index for index in richer if replaces(claim(index, plain, plain))), best)
