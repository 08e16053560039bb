"""Finds the parameter of a model that is the period of an independent clock, as its element declares."""

from rhythmid.model import Model


def clock_of(model: Model) -> str | None:
    """Name of the first parameter that is a clock's period, as "label.parameter"; None where the model has none."""
    for term in model.terms:
        if term.element.clock:
            return f"{term.label}.{term.element.clock}"
    return None


def has_clock(model: Model, label: str) -> bool:
    """Whether the term called `label` has a clock of its own."""
    term = model.term(label)
    return term is not None and bool(term.element.clock)
