"""A hypothesis: one fitted explanation of the records, with its prediction of data that its fit has not seen."""

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
    """The scores of a hypothesis in each block (b,) of data that its fit has not seen.

    `log_density` is the sum of the block's log predictive densities, divided by the autocorrelation time of the residual.
    `squared_error` is the sum of squared errors, and `samples` their number. `unseen` marks held-out blocks, of which no fit
    has seen even the neighbours: the hidden ends of records, and separate records.
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
    elements : labels of the added effects, in the order in which they were found; for a freed value its parameter's name.
    names : catalogue names of the effects, in the same order; for a freed value its own name.
    kind : kind of hypothesis.
    free : number of free parameters.
    prediction : scores in blocks that the fit has not seen; all hypotheses of a case have the same blocks.
    heldout_nrmse : error on held-out data, as a share of the motion or the effort; None where there are none.
    shape : statistics of the fitted effects themselves, by the name of the rule that uses them.
    richer : for each name, the laws that contain it.
    values : the fitted values of the free parameters.
    family : for each name of the catalogue, its family; "" where it has none.
    beyond : for each name, the effects that together are the law where a parameter is at the end of its range.
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
    beyond: Mapping[str, tuple[str, ...]] = field(default_factory=dict)

    @classmethod
    def of(
        cls, model: Model, elements: tuple[str, ...], kind: Kind, free: int, prediction: Prediction,
        heldout_nrmse: float | None, shape: Mapping[str, float], values: Mapping[str, float],
    ) -> "Hypothesis":  # fmt: skip
        """The hypothesis of a fitted model, with the catalogue's data of its effects."""
        terms = [model.term(label) for label in elements]
        names = tuple(label if one is None else one.element.name for label, one in zip(elements, terms))
        effects = [one.element for one in terms if one is not None]
        richer = {one.name: one.special_case_of for one in effects}
        family = {one.name: one.family for one in effects}
        beyond = {one.name: one.beyond for one in effects if one.beyond}
        return cls(
            elements, names, kind, free, prediction, heldout_nrmse, shape, richer, values, family, beyond
        )

    @property
    def effects(self) -> tuple[str, ...]:
        """Labels of effects. A freed value and a delay are not effects; they have the form "label.parameter"."""
        return tuple(label for label in self.elements if "." not in label)

    @property
    def key(self) -> tuple[str, ...]:
        """The elements in alphabetical order, equal for equal structures."""
        return tuple(sorted(self.elements))


def special_case(first: Hypothesis, second: Hypothesis) -> bool:
    """Whether the hypotheses differ in one effect only, and that of the first is a special case of that of the second."""
    mine, other = set(first.names) - set(second.names), set(second.names) - set(first.names)
    return len(mine) == len(other) == 1 and other <= set(first.richer.get(next(iter(mine)), ()))
