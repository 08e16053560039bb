"""Standard deviations from the scores of blocks: they cover what wanders more slowly than the noise remembers, and cost little else."""

from dataclasses import replace

import numpy as np
import pytest
from axes import CATALOGUE, axis, axis_model

import rhythmid as rh
from rhythmid.identify.inverse_dynamics.balance import Balance
from rhythmid.identify.inverse_dynamics.estimate import fit_effort
from rhythmid.identify.robust_covariance import CHANCE, widening, with_robust_std

ROWS = 4000


def estimate_of(wander: np.ndarray, rng: np.random.Generator) -> tuple[float, float]:
    """Error of a regression's one coefficient that wanders by this about 0, over its standard deviation; and the factor that widens that."""
    sensitivity = (np.sin(np.linspace(0.0, 400.0, ROWS)) * rng.uniform(0.5, 1.5))[:, None]
    residual = wander * sensitivity[:, 0] + rng.normal(size=ROWS)
    inverse = np.linalg.inv(sensitivity.T @ sensitivity)
    error = inverse @ sensitivity.T @ residual
    std = np.sqrt(np.diag(inverse))
    records = (slice(0, ROWS // 4), slice(ROWS // 4, ROWS))
    factor = widening(sensitivity, residual - sensitivity @ error, records, inverse, std)
    return float(error[0] / std[0]), float(factor[0])


def test_with_white_noise_standard_deviations_stay_as_the_information_says() -> None:
    rng = np.random.default_rng(1)
    factors = np.array([estimate_of(np.zeros(ROWS), rng)[1] for _ in range(400)])
    assert 0.3 * CHANCE < np.mean(factors > 1.0) < 3.0 * CHANCE


def test_what_wanders_is_covered_by_the_blocks_and_not_by_the_information() -> None:
    rng = np.random.default_rng(2)
    slow = np.repeat(rng.normal(size=(200, 80)), ROWS // 80, axis=1)
    found = np.array([estimate_of(wander, rng) for wander in slow])
    assert np.sqrt(np.mean(found[:, 0] ** 2)) > 3.0
    assert np.sqrt(np.mean((found[:, 0] / found[:, 1]) ** 2)) == pytest.approx(1.0, abs=0.25)


def test_with_fewer_blocks_than_parameters_they_say_nothing() -> None:
    few = widening(np.ones((30, 50)), np.ones(30), (slice(0, 30),), np.eye(50), np.ones(50))
    assert few.tolist() == [1.0] * 50


@pytest.mark.parametrize("wanders", [False, True])
def test_the_friction_of_an_axis_has_a_wider_interval_only_where_it_wanders(wanders: bool) -> None:
    """A friction that goes up and down by half over the record is no constant, and what is found depends on the stretch."""
    balance = Balance.of([axis()], axis_model())
    model = axis_model().with_element(CATALOGUE["coulomb_friction"], {"force": 0.8, "transition": 0.02})
    fit = fit_effort(balance, model)
    place = 1 + fit.names.index("coulomb_friction.force")
    if wanders:
        turn = np.sin(2.0 * np.pi * np.arange(len(fit.residual)) / len(fit.residual))
        fit = replace(fit, residual=fit.residual + 0.4 * turn * fit.jacobian[:, place])
    wider = with_robust_std(fit, balance.record).std / fit.std
    assert bool(wider[place] > 2.0) is wanders
    assert (wider >= 1.0).all()


def test_the_interval_of_a_delay_that_wanders_holds_its_mean() -> None:
    machine = rh.Model.from_text(
        """
inertia: {mass: {value: 1.0, unit: kg, fixed: true}}
force:
  - linear_spring: {stiffness: {value: 200.0, unit: N/m}, rest_length: {value: 0.0, unit: m, fixed: true}}
  - viscous_damper: {damping: {value: 1.0, unit: N*s/m}}
command:
  - input_delay: {delay: {value: 0.01, unit: s}}
"""
    )
    run = {
        "excitation": {"type": "multisine", "rms": 0.5, "band": [0.5, 6.0], "period": 5.0, "periods": 4},
        "forcing": {"amplitude": 0.0},
        "noise": {"measurement_std": 1e-5},
    }
    clean = rh.simulate(machine, run).record
    assert clean.input is not None
    time = clean.input.time
    scores = []
    for seed in range(6):
        rng = np.random.default_rng(seed)
        wander = 1e-3 * np.interp(time, np.linspace(time[0], time[-1], 20), rng.normal(size=20))
        late = replace(clean, input=replace(clean.input, time=time - (wander - wander.mean())))
        delay = rh.identify(late, machine).delays.sum
        assert delay.value is not None and delay.std is not None
        scores.append((delay.value - 0.01) / delay.std)
    assert np.sqrt(np.mean(np.square(scores))) < 2.0, scores


def test_a_parameter_whose_variance_is_too_large_to_be_squared_is_widened_as_any_other() -> None:
    rng = np.random.default_rng(2)
    sensitivity, residual = rng.normal(size=(ROWS, 1)), np.repeat(rng.normal(size=ROWS // 100), 100)
    records = (slice(0, ROWS),)
    factors = []
    for scale in (1.0, 1e80):
        columns = sensitivity / scale
        inverse = np.array([[1.0 / float(np.sum(sensitivity**2)) * scale * scale]])
        factors.append(float(widening(columns, residual, records, inverse, np.sqrt(np.diag(inverse)))[0]))
    assert factors[1] == pytest.approx(factors[0])


@pytest.mark.filterwarnings("error")
def test_a_parameter_of_which_the_records_say_nothing_is_left_alone() -> None:
    rng = np.random.default_rng(3)
    columns = np.column_stack([np.sin(np.linspace(0.0, 400.0, ROWS)), np.zeros(ROWS)])
    inverse = np.diag([1.0 / float(columns[:, 0] @ columns[:, 0]), 0.0])
    factors = widening(columns, rng.normal(size=ROWS), (slice(0, ROWS),), inverse, np.array([0.02, 1.0]))
    assert factors[1] == 1.0
