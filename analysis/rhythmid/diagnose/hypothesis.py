"""A hypothesis: one explanation of the records, fitted, with what it predicts of data that its fit has not seen."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from rhythmid.model import Model

Array = NDArray[np.float64]
Verdict = Literal["consistent", "missing_physics", "unknown_physics", "undecided"]
ScoringKind = Literal["free_run", "windows", "effort"]
Kind = Literal["nominal", "effects", "freed_value", "delay", "location", "free_map"]


@dataclass(frozen=True)
class Prediction:
    """What a hypothesis predicts of each block (b,) of data that its fit has not seen.

    `log_density` is the sum of the block's log predictive densities, divided by the autocorrelation time of the residual;
    `squared_error` the sum of squared errors, and `samples` their number. `unseen` marks the blocks of which no fit has seen even
    the neighbours: the held-out ends of records, and separate held-out ones.
    """

    log_density: Array
    squared_error: Array
    samples: Array
    unseen: NDArray[np.bool_] | None = None

    @property
    def score(self) -> float:
        """Log predictive density of all blocks."""
        return float(self.log_density.sum())

    @property
    def mean_square(self) -> float:
        """Mean squared error of prediction."""
        return float(self.squared_error.sum() / max(self.samples.sum(), 1.0))


@dataclass(frozen=True)
class Hypothesis:
    """One explanation.

    Parameters
    ----------
    elements : labels of the effects that the nominal model is given, in the order in which they were found; of a freed
        value its parameter's name.
    names : catalogue names of the effects, in the same order; a freed value's own name.
    kind : what is supposed.
    free : number of free parameters.
    prediction : of blocks that the fit has not seen; the blocks are those of all hypotheses of a case.
    heldout_nrmse : error on held-out data, as a share of the motion or the effort; None where there are none.
    shape : statistics of the fitted effects themselves, by the name of the rule that looks at them.
    richer : of each name, the laws that contain it.
    values : the free parameters as fitted.
    family : of each name of the catalogue, its family; "" where it has none.
    """

    elements: tuple[str, ...]
    names: tuple[str, ...]
    kind: Kind
    free: int
    prediction: Prediction
    heldout_nrmse: float | None = None
    shape: Mapping[str, float] = field(default_factory=dict)
    richer: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    values: Mapping[str, float] = field(default_factory=dict)
    family: Mapping[str, str] = field(default_factory=dict)

    @property
    def effects(self) -> tuple[str, ...]:
        """Labels of effects; a freed value and a delay go by the name of a parameter, "label.parameter"."""
        return tuple(label for label in self.elements if "." not in label)

    @property
    def key(self) -> tuple[str, ...]:
        """The elements in alphabetical order: the same for the same structure."""
        return tuple(sorted(self.elements))


def names_of(model: Model, elements: Sequence[str]) -> tuple[str, ...]:
    """Catalogue names of the effects with these labels; what is no effect keeps its own name."""
    terms = [(label, model.term(label)) for label in elements]
    return tuple(label if term is None else term.element.name for label, term in terms)


def richer_of(model: Model, elements: Sequence[str]) -> dict[str, tuple[str, ...]]:
    """By name, the laws that contain the effects with these labels as special cases."""
    terms = [model.term(label) for label in elements]
    return {term.element.name: term.element.special_case_of for term in terms if term is not None}


def family_of(model: Model, elements: Sequence[str]) -> dict[str, str]:
    """By name, the families of the effects with these labels."""
    terms = [model.term(label) for label in elements]
    return {term.element.name: term.element.family for term in terms if term is not None}


def special_case(first: Hypothesis, second: Hypothesis) -> bool:
    """Whether the first is the second but for one effect, of which its own is a special case."""
    mine, other = set(first.names) - set(second.names), set(second.names) - set(first.names)
    return len(mine) == len(other) == 1 and other <= set(first.richer.get(next(iter(mine)), ()))
