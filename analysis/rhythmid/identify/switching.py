"""Positions and velocities at which a model's forces switch."""

from rhythmid.elements.element import Element
from rhythmid.model import Model, Term
from rhythmid.report.run import Switch


def switches_of(model: Model) -> tuple[Switch, ...]:
    """Every place in position or velocity at which an element of the model switches."""
    return tuple(
        Switch(term.element.switches[0], _place(model, term, term.element.switches[1]), term.element.title)
        for term in model.terms
        if term.element.switches is not None
    )


def _place(model: Model, term: Term, parameter: str) -> float:
    element: Element = term.element
    if parameter == "":
        return 0.0
    if parameter in term.values:
        return term.values[parameter].value
    name, default = element.borrows[parameter]
    known = model.parameters.get(name)
    return known.value if known is not None else float(default or 0.0)
