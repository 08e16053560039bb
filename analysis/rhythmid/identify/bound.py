"""Cramér-Rao bound: the smallest standard deviations that any unbiased estimator can reach.

It is the inverse of the Fisher information of the sampled output under Gaussian noise. The initial states are
nuisance parameters (S. M. Kay, Fundamentals of Statistical Signal Processing: Estimation Theory, 1993, section
3.9). The sensitivities come from the estimator's own simulator. The bound can be computed before or after the data
are recorded.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from rhythmid.errors import InputError
from rhythmid.experiment import Experiment, Noise
from rhythmid.identify.joint import prepared_model
from rhythmid.identify.noise import NoiseModel
from rhythmid.identify.output_error import Fit, minimise, start_only
from rhythmid.identify.search_quality import cycle_columns
from rhythmid.identify.series import prepare
from rhythmid.model import Model
from rhythmid.offline_run import perform
from rhythmid.record.messages import Messages
from rhythmid.record.record import Channel, Record

Array = NDArray[np.float64]
# share of a block per integration step: when a delay meets the sample grid, coarser steps corrupt the finite differences
FINE = 0.05


@dataclass(frozen=True)
class Bound:
    """`covariance` (p, p) of the parameters `names` at the Cramér-Rao bound."""

    names: tuple[str, ...]
    covariance: Array

    @property
    def std(self) -> Mapping[str, float]:
        """Smallest standard deviation of each parameter; infinite where the record does not determine it."""
        return {
            n: math.sqrt(v) if v < 1e20 else math.inf for n, v in zip(self.names, np.diag(self.covariance))
        }


def planned_record(experiment: Experiment) -> Record:
    """Record that an experiment would give without noise: inputs and timestamps. Of its motion only the start is used."""
    topics = perform(replace(experiment, noise=Noise()))
    command, forcing, output = topics["excitation"], topics["forcing"], topics["joint_states"]
    if output.position is None or command.effort is None or forcing.effort is None:
        raise InputError("the experiment gives no motion")
    return Record(
        "planned",
        Channel(_seconds(output), output.position, "m"),
        Channel(_seconds(command), command.effort, "N"),
        Channel(_seconds(forcing), forcing.effort, "N"),
        run=experiment.description(),
    )


def _seconds(messages: Messages) -> Array:
    """Timestamps [s] (n,)."""
    return messages.stamp_ns.astype(np.float64) * 1e-9


def cramer_rao(model: Model, records: Record | Sequence[Record], std: float, cycle: bool = True) -> Bound:
    """Bound at the model's own values, for records with these inputs and timestamps; arguments as for `expected_fit`."""
    fit = expected_fit(model, records, std, cycle)
    return Bound(fit.names, fit.covariance)


def expected_fit(model: Model, records: Record | Sequence[Record], std: float, cycle: bool = True) -> Fit:
    """The fit at the model's own values whose covariance is the bound, for records with these inputs and timestamps.

    `std` [output unit] is the standard deviation of white noise on a single sample. Only the start of each record's
    output is used, so planned and real records can both be given. With `cycle` False the limit cycle contributes no
    information. Raises InputError when `std` is not positive.
    """
    if not std > 0.0:
        raise InputError(f"noise of {std:g} bounds nothing; give its standard deviation, greater than 0")
    given = (records,) if isinstance(records, Record) else tuple(records)
    ready, pumping = prepared_model(model, given)
    series = prepare(given)
    if not cycle and pumping is not None:
        series = [replace(one, ignored=cycle_columns(one, pumping)) for one in series]
    noise = NoiseModel(np.empty(0), std / math.sqrt(series[0].block))
    plain = [replace(one, ignored=None) for one in series]
    begun = start_only(ready, plain, noise, FINE * series[0].period * series[0].block)
    run = replace(begun.run, series=tuple(series))
    return minimise(ready, run, ready.free, noise, begun.starts, iterations=0)
