"""A fit whose residuals go with the motion is not whitened: measurements that are held back and come in bursts."""

from dataclasses import replace

import numpy as np

import rhythmid as rh
from rhythmid.identify.joint import best_fit
from rhythmid.identify.robust_covariance import with_robust_covariance
from rhythmid.identify.specification import well_specified
from rhythmid.record.record import Record

MODEL = """
inertia: {mass: {value: 1.0, unit: kg, fixed: true}}
force:
  - linear_spring: {stiffness: {value: 200.0, unit: N/m}, rest_length: {value: 0.0, unit: m, fixed: true}}
  - viscous_damper: {damping: {value: 1.0, unit: N*s/m}}
"""
DAMPING = "viscous_damper.damping"
RUN = {
    "excitation": {"type": "chirp", "amplitude": 1.0, "band": [0.2, 7.0], "sweep": 20.0},
    "forcing": {"amplitude": 0.0},
    "noise": {"measurement_std": 1e-5},
}


def recorded(seed: int, held: float) -> Record:
    """A driven oscillator whose measurements are late by up to `held` [s], all those in waiting at one time."""
    record = rh.simulate(rh.Model.from_text(MODEL), RUN | {"seed": seed}).record
    if not held:
        return record
    rng, time = np.random.default_rng(seed), record.output.time
    release = time[0] + np.cumsum(rng.uniform(0.2 * held, held, int(8 * np.ptp(time) / held)))
    stamps = release[np.searchsorted(release, time)] + 1e-6 * np.arange(len(time))
    return replace(record, output=replace(record.output, time=stamps))


def test_of_well_specified_records_the_whitened_fit_is_told() -> None:
    fit = best_fit(recorded(1, 0.0), rh.Model.from_text(MODEL)).fit
    assert well_specified(fit).values.tolist() == fit.values.tolist()


def test_where_measurements_come_in_bursts_the_damping_holds_the_truth_and_that_of_the_whitened_fit_does_not() -> (
    None
):
    for seed in range(2):
        fit = best_fit(recorded(seed, 0.02), rh.Model.from_text(MODEL)).fit
        errors = []
        for one in (well_specified(fit), with_robust_covariance(fit)):
            value, std = one.values[one.names.index(DAMPING)], one.std[DAMPING]
            errors.append(abs(value - 1.0) / std)
        assert errors[0] < 3.0 < errors[1], errors
