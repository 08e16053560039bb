"""Predicted accuracy of a run: the Cramér-Rao bound at the model's own values, for every free parameter."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import reduce

import numpy as np

from rhythmid.errors import InputError
from rhythmid.experiment import Experiment
from rhythmid.identify.bound import expected_fit, planned_record
from rhythmid.identify.harmonic_likelihood import DELAYS, INPUT_DELAY, MEASUREMENT_DELAY
from rhythmid.identify.identifiability import SEEN
from rhythmid.identify.identification import Estimate
from rhythmid.identify.output_error import Fit
from rhythmid.identify.undetermined import undetermined
from rhythmid.ltp.limit_cycle import LimitCycle
from rhythmid.model import Model
from rhythmid.record.record import Record


@dataclass(frozen=True, eq=False)
class Prediction:
    """The noise-free `record` of the run, and the `fit` to it, whose standard deviations are the bound."""

    record: Record
    fit: Fit

    def _estimate(self, name: str) -> Estimate:
        return Estimate(self.fit.model.value(name), self.fit.std[name], self.fit.model.parameters[name].unit)

    @property
    def parameters(self) -> Mapping[str, Estimate]:
        """Free parameters other than the delays, with their predicted standard deviations."""
        return {name: self._estimate(name) for name in self.fit.names if name not in DELAYS}

    @property
    def delays(self) -> Mapping[str, Estimate]:
        """`input`, `measurement` and `sum` [s] with their predicted standard deviations."""
        known = {"input": INPUT_DELAY, "measurement": MEASUREMENT_DELAY}
        found = {which: self._estimate(name) for which, name in known.items() if name in self.fit.names}
        if len(found) == 2:
            places = [self.fit.names.index(name) for name in DELAYS]
            variance = float(self.fit.covariance[np.ix_(places, places)].sum())
            total = sum(self.fit.model.value(name) for name in DELAYS)
            found["sum"] = Estimate(total, math.sqrt(max(variance, 0.0)), "s")
        return found


def predict(model: Model, experiment: Experiment, noise_std: float) -> Prediction:
    """Prediction for a `model` with both delays. Raises InputError naming what the run would not determine."""
    record = planned_record(experiment)
    fit = expected_fit(model, record, noise_std)
    nothing = undetermined(fit)
    if nothing:
        words = "; ".join(direction.words for direction in nothing)
        raise InputError(
            f"the design cannot determine all free parameters: {words}; fix one of them in the model"
        )
    return Prediction(record, fit)


def require_unambiguous_delays(cycle: LimitCycle, longest: float) -> None:
    """Refuse delays up to `longest` [s] that are ambiguous: shifts by T/gcd of the cycle's harmonics give the same record."""
    lines = np.abs(cycle.harmonics(8)[1:])
    seen = [n + 1 for n in range(len(lines)) if lines[n] > SEEN * lines.max()]
    shift = cycle.pumping.period / reduce(math.gcd, seen)
    if longest >= shift:
        raise InputError(
            f"delays up to {longest:g} s alias: a shift by {shift:g} s from one delay to the other gives the same record; "
            "state a --longest-delay below that, or slow the forcing down"
        )
