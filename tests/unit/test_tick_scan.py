"""The scan for a drive's own clock: the period of a hold is found where no descent could find it."""

from dataclasses import replace

import numpy as np
import pytest

from machines import CATALOGUE, hopper
from rhythmid.identify.noise import NoiseModel
from rhythmid.identify.sample_clock.tick_scan import scanned
from rhythmid.identify.series import Series
from rhythmid.model import Model
from rhythmid.simulation.signal import zero_order_hold
from rhythmid.simulation.simulate import simulate
from rhythmid.simulation.transport import INPUT_DELAY

SAMPLE, DURATION, STEP = 1e-3, 12.0, 2e-3
PERIOD = "command_hold.period"
TRUE = {INPUT_DELAY: 0.0130457, PERIOD: 0.0812347}
PERIODS = (0.0812347, 0.0613571)
NOISE = NoiseModel(np.empty(0), 1e-4)


def held(values: dict[str, float]) -> Model:
    """The hopper with a command hold."""
    return hopper().with_element(CATALOGUE["command_hold"], {"period": 0.05}).with_values(values)


def recorded(period: float) -> tuple[Series, np.ndarray]:
    """A record of the hopper under commands of up to 7 Hz, held by its drive, and the state that it begins in."""
    rng = np.random.default_rng(4)
    time = SAMPLE * np.arange(round(DURATION / SAMPLE))
    command = zero_order_hold(time, 0.8 * np.sin(2 * np.pi * 7.0 / (2.0 * DURATION) * time**2))
    run = simulate(held(TRUE | {PERIOD: period}), time, command, None, (0.16, 0.0), STEP)
    value = run.output + NOISE.std * rng.standard_normal(len(time))
    return Series("made", time, value, command, None, 1, np.ones(len(time), bool), SAMPLE), run.states[0]


@pytest.fixture(scope="module")
def case() -> tuple[Series, np.ndarray]:
    return recorded(TRUE[PERIOD])


@pytest.mark.parametrize(
    "period", [PERIODS[0], *(pytest.param(one, marks=pytest.mark.long) for one in PERIODS[1:])]
)
def test_the_period_of_a_held_command_is_found_within_ten_microseconds(period):
    series, start = recorded(period)
    mean = TRUE[INPUT_DELAY] + 0.5 * period
    off = held({INPUT_DELAY: mean, "linear_spring.stiffness": 200.05, "switched_damper.stance": 1.99})
    best = scanned(off, [series], [start], NOISE)[0]
    assert best[PERIOD] == pytest.approx(period, abs=1e-5)
    assert best[INPUT_DELAY] + 0.5 * best[PERIOD] == pytest.approx(mean, abs=1e-3)


@pytest.mark.parametrize(
    "period",
    [
        0.1710123,
        pytest.param(0.1110123, marks=pytest.mark.long),
        pytest.param(0.1040123, marks=pytest.mark.long),
        pytest.param(0.0970123, marks=pytest.mark.long),
    ],
)
def test_ticks_hardly_faster_than_the_motion_are_found_by_a_model_that_is_a_little_wrong(period):
    series, start = recorded(period)
    off = held(
        {
            INPUT_DELAY: TRUE[INPUT_DELAY] + 0.5 * period,
            "linear_spring.stiffness": 200.5,
            "switched_damper.stance": 1.9,
        }
    )
    assert scanned(off, [series], [start], NOISE)[0][PERIOD] == pytest.approx(period, abs=2e-5)


def test_nothing_is_guessed_without_delay_or_command(case):
    series, start = case
    assert scanned(held({INPUT_DELAY: 0.0}), [series], [start], NOISE) == []
    assert scanned(held({INPUT_DELAY: 0.03}), [replace(series, command=None)], [start], NOISE) == []


def test_nothing_is_guessed_where_a_hold_would_have_to_be_faster_than_the_measurement_shows(case):
    series, start = case
    assert scanned(held({INPUT_DELAY: 0.001}), [series], [start], NOISE) == []
