"""Measurements that are held back and come in bursts leave what goes with the motion: the fit is not weighted by its colour then."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

import rhythmid as rh
from rhythmid.identify.identifiability import delays_of
from rhythmid.identify.identify import paper_hopper
from rhythmid.identify.joint import JointFit, best_fit
from rhythmid.identify.output_error import MISLED, Fit, minimise, noise_of
from rhythmid.identify.robust_covariance import with_robust_covariance
from rhythmid.identify.weighting import efficient_fit
from rhythmid.record.record import Record

RUN = {
    "excitation": {"type": "chirp", "amplitude": 0.1, "band": [0, 7], "sweep": 20.0},
    "forcing": {"amplitude": 1.0, "frequency": 1.0},
    "delays": {"input": 0.04, "measurement": 0.05},
    "noise": {"measurement_std": 1e-5},
}


def recorded(seed: int, held: float) -> Record:
    """A hopper whose measurements are late by up to `held` [s], all those in waiting at one time."""
    record = rh.simulate(paper_hopper(), RUN | {"seed": seed}).record
    if not held:
        return record
    rng, time = np.random.default_rng(seed), record.output.time
    release = time[0] + np.cumsum(rng.uniform(0.2 * held, held, int(8 * np.ptp(time) / held)))
    stamps = release[np.searchsorted(release, time)] + 1e-9 * np.arange(len(time))
    return replace(record, output=replace(record.output, time=stamps))


@cache
def identified(seed: int, held: float) -> JointFit:
    """What is found from such a record."""
    return best_fit(recorded(seed, held), paper_hopper())


def given_of(seed: int, held: float) -> Fit:
    """The fit that is given for such a record."""
    return identified(seed, held).fit


@cache
def weighted_by_colour(seed: int, held: float) -> Fit:
    """The fit that is weighted by the colour of what ordinary least squares leaves, whatever that is."""
    fit = given_of(seed, held)
    colour = noise_of(fit.residuals, fit.run.series)
    assert colour.order > 0
    return minimise(fit.model, fit.run, fit.names, colour, fit.starts)


def test_noise_that_is_added_to_the_output_is_weighted_by_its_colour() -> None:
    fit = given_of(1, 0.0)
    assert efficient_fit(fit).values.tolist() == fit.values.tolist()


@pytest.mark.parametrize("seed", [0, pytest.param(1, marks=pytest.mark.long)])
def test_what_comes_in_bursts_is_not_and_the_intervals_hold_the_truth(seed: int) -> None:
    true = {"linear_spring.stiffness": 200.0, "switched_damper.stance": 2.0, "input_delay.delay": 0.04}
    found = weighted_by_colour(seed, 0.06)
    weighted = with_robust_covariance(found)
    told = efficient_fit(found)
    for fit, holds in ((told, True), (weighted, False)):
        errors = [abs(fit.model.value(name) - value) / fit.std[name] for name, value in true.items()]
        assert (max(errors) < 3.0) is holds, errors


@pytest.mark.parametrize("seed", [0, 1])
def test_a_fit_whose_weights_give_up_the_motion_is_not_given(seed: int) -> None:
    given = given_of(seed, 0.06)
    assert given.noise.order == 0
    assert weighted_by_colour(seed, 0.06).nrmse() > MISLED * given.nrmse()
    assert given.model.value("linear_spring.stiffness") == pytest.approx(200.0, abs=2.0)


def test_limit_cycle_and_response_are_not_said_to_disagree_where_measurements_come_in_bursts() -> None:
    closure = delays_of(identified(1, 0.06)).closure
    assert closure is not None and abs(closure) < 3.0  # -5.4 by the information alone
