"""A hypothesis: one explanation of the records, fitted, with what it predicts of data that its fit has not seen."""

from collections.abc import Mapping
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

    @classmethod
    def of(
        cls, model: Model, elements: tuple[str, ...], kind: Kind, free: int, prediction: Prediction,
        heldout_nrmse: float | None, shape: Mapping[str, float], values: Mapping[str, float],
    ) -> "Hypothesis":  # fmt: skip
        """The hypothesis that a fitted model is, with what the catalogue says of its effects."""
        terms = [model.term(label) for label in elements]
        names = tuple(label if one is None else one.element.name for label, one in zip(elements, terms))
        effects = [one.element for one in terms if one is not None]
        richer = {one.name: one.special_case_of for one in effects}
        family = {one.name: one.family for one in effects}
        return cls(elements, names, kind, free, prediction, heldout_nrmse, shape, richer, values, family)

    @property
    def effects(self) -> tuple[str, ...]:
        """Labels of effects; a freed value and a delay go by the name of a parameter, "label.parameter"."""
        return tuple(label for label in self.elements if "." not in label)

    @property
    def key(self) -> tuple[str, ...]:
        """The elements in alphabetical order: the same for the same structure."""
        return tuple(sorted(self.elements))


def special_case(first: Hypothesis, second: Hypothesis) -> bool:
    """Whether the first is the second but for one effect, of which its own is a special case."""
    mine, other = set(first.names) - set(second.names), set(second.names) - set(first.names)
    return len(mine) == len(other) == 1 and other <= set(first.richer.get(next(iter(mine)), ()))
