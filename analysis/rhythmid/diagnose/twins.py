"""Twins: elements that replace one another in equally good models, so that these records cannot tell them apart."""

from collections.abc import Sequence

from rhythmid.diagnose.search.refit import Trial
from rhythmid.model import Model


def twins_of(best: Trial, rivals: Sequence[Trial]) -> list[tuple[str, ...]]:
    """Families within which the records cannot tell: elements that replace one another in equally good models.

    Every family begins with what the best model has of it. Where one element can replace several, all are one family.
    """
    groups: list[tuple[str, ...]] = []
    for label in best.added:
        element = best.element(label)
        others = list(element.same_as)
        others += [other for beside, other in element.same_beside.items() if _estimated(best.model, beside)]
        for rival in rivals:
            gone = set(best.added) - set(rival.added)
            come = set(rival.added) - set(best.added)
            if gone == {label} and len(come) == 1:
                other = rival.element(come.pop()).name
                # what contains the element is no rival, unless it does better with all its parameters
                wider = other in element.special_case_of and rival.bic() >= best.bic()
                if other not in others and not wider:
                    others.append(other)
        if others:
            groups.append((element.name, *others))
    named = {best.element(label).name for label in best.added}
    order = [name for group in groups for name in group]
    return [
        tuple(sorted(family, key=lambda name: (name not in named, order.index(name))))
        for family in _joined(groups)
    ]


def _joined(groups: Sequence[tuple[str, ...]]) -> list[set[str]]:
    """Unions of the groups that share a member."""
    joined: list[set[str]] = []
    for group in groups:
        apart = [one for one in joined if one.isdisjoint(group)]
        joined = [*apart, set(group).union(*(one for one in joined if one not in apart))]
    return joined


def _estimated(model: Model, name: str) -> bool:
    """Whether the model has the named element, with parameters that are not all known."""
    return any(t.element.name == name and not all(v.fixed for v in t.values.values()) for t in model.terms)
