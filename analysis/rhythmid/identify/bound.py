"""Cramér-Rao bound: the smallest standard deviations that any unbiased estimator can reach, before or after the data.

The inverse of the Fisher information of the sampled output under Gaussian noise, with the initial states as nuisances
(S. M. Kay, Fundamentals of Statistical Signal Processing: Estimation Theory, 1993, section 3.9). The sensitivities are
those of the estimator itself: the simulator's, parameter by parameter.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from rhythmid.errors import InputError
from rhythmid.experiment import Experiment, Noise
from rhythmid.identify.joint import cycle_columns, prepared_model
from rhythmid.identify.noise import NoiseModel
from rhythmid.identify.output_error import Fit, minimise, start_only
from rhythmid.identify.series import prepare
from rhythmid.model import Model
from rhythmid.offline_run import perform
from rhythmid.record.messages import Messages
from rhythmid.record.record import Channel, Record

Array = NDArray[np.float64]
FINE = 0.05  # of a block, integrated in one step: at a delay that meets the samples' grid coarser ones mislead the differences


@dataclass(frozen=True)
class Bound:
    """`covariance` (p, p) of the parameters `names` at best."""

    names: tuple[str, ...]
    covariance: Array

    @property
    def std(self) -> Mapping[str, float]:
        """Smallest standard deviation of each parameter; infinite where the record does not determine it."""
        return {
            n: math.sqrt(v) if v < 1e20 else math.inf for n, v in zip(self.names, np.diag(self.covariance))
        }


def planned_record(experiment: Experiment) -> Record:
    """What an experiment would record without noise: inputs, stamps, and a motion from which only the start is taken."""
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
    """Stamps [s] (n,)."""
    return messages.stamp_ns.astype(np.float64) * 1e-9


def cramer_rao(model: Model, records: Record | Sequence[Record], std: float, cycle: bool = True) -> Bound:
    """Bound at the model's own values for records with these inputs and stamps; arguments as for `expected_fit`."""
    fit = expected_fit(model, records, std, cycle)
    return Bound(fit.names, fit.covariance)


def expected_fit(model: Model, records: Record | Sequence[Record], std: float, cycle: bool = True) -> Fit:
    """The fit at the model's own values whose covariance is the bound, for records with these inputs and stamps.

    `std` [output unit] is that of a single sample's noise, which is white. Of the records' outputs only the start is
    taken, so planned and real ones serve alike. With `cycle` False nothing is learnt from the limit cycle. Raises
    InputError when `std` is not positive.
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
