"""Standard deviations from the scores of blocks: they cover what wanders more slowly than the noise remembers, and cost little else."""

from dataclasses import replace

import numpy as np
import pytest

import rhythmid as rh
from rhythmid.identify.robust_covariance import BLOCKS, scattered

ROWS = 4000


def estimate_of(wander: np.ndarray, rng: np.random.Generator) -> tuple[float, float, float]:
    """Error of a regression's one coefficient that wanders by this about 0, its standard deviation by the information, and by blocks."""
    sensitivity = np.sin(np.linspace(0.0, 400.0, ROWS)) * rng.uniform(0.5, 1.5)
    residual = wander * sensitivity + rng.normal(size=ROWS)
    information = float(sensitivity @ sensitivity)
    value = float(sensitivity @ residual) / information
    scores = (sensitivity * (value * sensitivity - residual))[:, None]
    records = (slice(0, ROWS // 4), slice(ROWS // 4, ROWS))
    std = scattered(scores, records, np.array([[1.0 / information]]))
    return value, information**-0.5, float(std[0])


def test_with_white_noise_blocks_say_what_the_information_says() -> None:
    rng = np.random.default_rng(1)
    found = np.array([estimate_of(np.zeros(ROWS), rng) for _ in range(200)])
    assert np.mean(found[:, 2] ** 2 / found[:, 1] ** 2) == pytest.approx(1.0, abs=0.1)
    assert np.std(found[:, 2] / found[:, 1]) == pytest.approx((2.0 * BLOCKS) ** -0.5, rel=0.5)


def test_what_wanders_is_covered_by_the_blocks_and_not_by_the_information() -> None:
    rng = np.random.default_rng(2)
    slow = np.repeat(rng.normal(size=(200, 80)), ROWS // 80, axis=1)
    found = np.array([estimate_of(wander, rng) for wander in slow])
    assert np.sqrt(np.mean((found[:, 0] / found[:, 1]) ** 2)) > 3.0
    assert np.sqrt(np.mean((found[:, 0] / found[:, 2]) ** 2)) == pytest.approx(1.0, abs=0.25)


def test_with_fewer_blocks_than_parameters_they_say_nothing() -> None:
    assert scattered(np.ones((30, 50)), (slice(0, 30),), np.eye(50)).tolist() == [0.0] * 50


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
