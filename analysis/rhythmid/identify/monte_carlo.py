"""Monte Carlo of an estimator: noise drawn anew, the scatter of what is found, how often its intervals hold the truth."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from rhythmid.identify.output_error import Fit
from rhythmid.record.record import Record

COVER = 1.959964  # standard deviations on either side of a 95 % interval


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


def scatter(fits: Sequence[Fit], name: str, truth: float) -> Scatter:
    """Scatter of the parameter `name` over fits of independent noise about its true value."""
    values = np.array([fit.model.value(name) for fit in fits])
    stds = np.array([fit.std[name] for fit in fits])
    covered = np.abs(values - truth) < COVER * stds
    return Scatter(float(values.std(ddof=1)), float(values.mean() - truth), float(covered.mean()))
