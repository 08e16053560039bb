"""The identified model within the bounds of its file, so that what is saved can be read again.

A fit extends some bounds: a delay may come out negative, for noise scatters about zero, and no delay exceeds the longest record.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace

from rhythmid.model import MASS, Model
from rhythmid.value import Value

SCATTER = 2.0  # standard deviations by which a parameter that the file does not have may pass a bound without a word: it scatters


@dataclass(frozen=True)
class Admissible:
    """The model, and one note for each value that was moved to a bound by more than scatter, or that the file states."""

    model: Model
    moved: Mapping[str, str]

    @property
    def notes(self) -> tuple[str, ...]:
        return tuple(self.moved.values())


def admissible(model: Model, nominal: Model, std: Mapping[str, float] | None = None) -> Admissible:
    """The model with the bounds and priors of `nominal`, or of its elements where `nominal` has no such parameter, and its values
    within these bounds.

    Parameters
    ----------
    model
        As fitted.
    nominal
        As given.
    std
        Standard deviations of the estimates, by the name of the parameter.
    """
    given = nominal.parameters
    usual = {f"{t.label}.{p.name}": p.bounds for t in model.terms for p in t.element.parameters}
    changes, moved = {}, {}
    for name, value in model.parameters.items():
        low, high = given[name].bounds if name in given else usual.get(name, MASS.bounds)
        inside = min(max(value.value, low), high)
        prior = given[name].prior if name in given else None
        changes[name] = replace(value, value=inside, bounds=(low, high), prior=prior)
        spread = (std or {}).get(name, 0.0)
        if inside != value.value and (name in given or abs(inside - value.value) > SCATTER * spread):
            moved[name] = _note(name, value, inside, (std or {}).get(name))
    return Admissible(model.with_parameters(changes), moved)


def _note(name: str, value: Value, inside: float, std: float | None) -> str:
    scale, unit = (1e3, "ms") if value.unit == "s" else (1.0, value.unit)
    error = "" if std is None else f" ± {scale * std:.2g}"
    why = (
        "for a machine does not respond before its command"
        if value.unit == "s" and value.value < inside == 0.0
        else "its bound"
    )
    return f"{name} comes out at {scale * value.value:.3g}{error} {unit} and is saved as {scale * inside:.6g} {unit}, {why}"
