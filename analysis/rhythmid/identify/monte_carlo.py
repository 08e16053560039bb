"""Monte Carlo of an estimator: noise drawn anew, the scatter of what is found, how often its intervals hold the truth."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from rhythmid.identify.output_error import Fit
from rhythmid.record.record import Record
from rhythmid.statistics import NORMAL_95


@dataclass(frozen=True)
class Drawn:
    """What one fit found: `values` and stated standard deviations `std` by name."""

    values: Mapping[str, float]
    std: Mapping[str, float]

    @classmethod
    def of(cls, fit: Fit, names: Sequence[str]) -> "Drawn":
        """The parameters `names` of a fit."""
        stds = fit.std
        return cls({n: fit.model.value(n) for n in names}, {n: stds[n] for n in names})


@dataclass(frozen=True)
class Scatter:
    """Standard deviation and bias of estimates, and the share of 95 % intervals that hold the truth."""

    std: float
    bias: float
    coverage: float


def noisy(record: Record, std: float, seed: int) -> Record:
    """The record with white noise of so much on its output [output unit]; the same for the same seed."""
    output = record.output
    value = output.value + std * np.random.default_rng(seed).standard_normal(len(output))
    return replace(record, output=replace(output, value=value))


def scatter(found: Sequence[Drawn], name: str, truth: float) -> Scatter:
    """Scatter of the parameter `name` over fits of independent noise about its true value."""
    values = np.array([one.values[name] for one in found])
    stds = np.array([one.std[name] for one in found])
    covered = np.abs(values - truth) < NORMAL_95 * stds
    return Scatter(float(values.std(ddof=1)), float(values.mean() - truth), float(covered.mean()))
