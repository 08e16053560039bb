"""Parameters of a named effect of which the records tell nothing, such as the speed over which a dry friction turns."""

from dataclasses import replace

from rhythmid.diagnose.answer.result import Estimate, MissingEffect
from rhythmid.elements.element import Element, Scales
from rhythmid.identify.natural_size import is_told, natural_size
from rhythmid.model import Model


def without_untold(
    missing: tuple[MissingEffect, ...], model: Model, known: Scales
) -> tuple[MissingEffect, ...]:
    """The effects, the standard deviation None of each parameter of which nothing is told; never of an effect's own size, by which it was
    found. `known` are the scales of the records."""
    elements = {term.element.name: term.element for term in model.terms}
    return tuple(replace(one, parameters=_judged(one, elements[one.element], known)) for one in missing)


def _judged(effect: MissingEffect, element: Element, known: Scales) -> dict[str, Estimate]:
    units = {one.name: one.unit for one in element.parameters}
    return {
        name: one
        if name == element.size
        or not one.std
        or is_told(one.value, one.std, natural_size(units[name], known))
        else replace(one, std=None)
        for name, one in effect.parameters.items()
    }
