"""Monte Carlo test of an estimator: new noise for each fit, scatter of the estimates, and coverage of their intervals."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from rhythmid.identify.output_error import Fit
from rhythmid.record.record import Record
from rhythmid.statistics import NORMAL_95


@dataclass(frozen=True)
class Drawn:
    """Result of one fit: `values` and stated standard deviations `std` by name."""

    values: Mapping[str, float]
    std: Mapping[str, float]

    @classmethod
    def of(cls, fit: Fit, names: Sequence[str]) -> "Drawn":
        """The parameters `names` of a fit."""
        stds = fit.std
        return cls({n: fit.model.value(n) for n in names}, {n: stds[n] for n in names})


@dataclass(frozen=True)
class Scatter:
    """Standard deviation and bias of estimates, and the coverage of their 95 % intervals."""

    std: float
    bias: float
    coverage: float


def noisy(record: Record, std: float, seed: int) -> Record:
    """The record with white noise of standard deviation `std` [output unit] on its output, reproducible by `seed`."""
    output = record.output
    value = output.value + std * np.random.default_rng(seed).standard_normal(len(output))
    return replace(record, output=replace(output, value=value))


def scatter(found: Sequence[Drawn], name: str, truth: float) -> Scatter:
    """Scatter of the parameter `name` over fits of independent noise about its true value."""
    values = np.array([one.values[name] for one in found])
    stds = np.array([one.std[name] for one in found])
    covered = np.abs(values - truth) < NORMAL_95 * stds
    return Scatter(float(values.std(ddof=1)), float(values.mean() - truth), float(covered.mean()))
