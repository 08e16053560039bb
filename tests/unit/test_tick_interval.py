"""The period of a held command is followed to its likeliest ticks, and its interval holds the truth."""

from dataclasses import replace

import numpy as np
import pytest

from machines import CATALOGUE, hopper, search_of
from rhythmid.diagnose.intervals import ticks_followed
from rhythmid.identify.noise import NoiseModel
from rhythmid.identify.output_error import Fit, estimate
from rhythmid.identify.sample_clock.tick_likelihood import ticks_sought
from rhythmid.identify.series import Series
from rhythmid.model import Model
from rhythmid.simulation.signal import zero_order_hold
from rhythmid.simulation.simulate import simulate
from rhythmid.simulation.transport import INPUT_DELAY

SAMPLE, DURATION, STEP = 1e-3, 12.0, 2e-3
PERIOD = "command_hold.period"
TRUE = {INPUT_DELAY: 0.0130457, PERIOD: 0.0812347}
NOISE = NoiseModel(np.empty(0), 1e-4)


def held(**values: float) -> Model:
    """The hopper with a command hold, its measurement at once: without a forcing the two delays cannot be told apart."""
    model = (
        hopper().with_element(CATALOGUE["command_hold"], {"period": TRUE[PERIOD]}).with_values(TRUE | values)
    )
    late = "measurement_delay.delay"
    return model.with_parameters({late: replace(model.parameters[late], fixed=True)})


def recorded(seed: int) -> Series:
    """A record of the hopper under commands of up to 7 Hz, held by its drive."""
    time = SAMPLE * np.arange(round(DURATION / SAMPLE))
    command = zero_order_hold(time, 0.8 * np.sin(2 * np.pi * 7.0 / (2.0 * DURATION) * time**2))
    run = simulate(held(), time, command, None, (0.16, 0.0), STEP)
    value = run.output + NOISE.std * np.random.default_rng(seed).standard_normal(len(time))
    return Series("made", time, value, command, None, 1, np.ones(len(time), bool), SAMPLE)


def fitted(seed: int, off: float) -> Fit:
    """The fit that begins with a period that is off by so many seconds, as far as a descent gets."""
    begin = held(**{PERIOD: TRUE[PERIOD] + off, INPUT_DELAY: TRUE[INPUT_DELAY] - 0.5 * off})
    return estimate(begin, [recorded(seed)], noise=NOISE, max_step=STEP)


@pytest.mark.parametrize("seed", [0, pytest.param(1, marks=pytest.mark.long)])
def test_the_interval_of_the_period_holds_the_truth_where_the_curvature_says_nothing(seed):
    fit = fitted(seed, 2e-6)
    found = ticks_followed(search_of(fit, "command_hold"))
    assert found.fit.chi2 <= fit.chi2
    for name in (PERIOD, INPUT_DELAY):
        assert abs(found.fit.model.value(name) - TRUE[name]) < 3.0 * found.fit.std[name]
    assert found.fit.std[PERIOD] < 1e-6
    assert found.best.model is found.fit.model


def test_a_period_that_was_missed_is_found_under_the_noise_that_its_hold_leaves():
    fit = fitted(0, 3e-4)
    assert abs(fit.model.value(PERIOD) - TRUE[PERIOD]) > 1e-4
    again = ticks_sought(fit, 1e-9)
    assert again.model.value(PERIOD) == pytest.approx(TRUE[PERIOD], abs=1e-6)


def test_a_model_without_a_free_period_is_left_alone():
    model = held()
    given = replace(model.parameters[PERIOD], fixed=True)
    fit = estimate(model.with_parameters({PERIOD: given}), [recorded(0)], noise=NOISE, max_step=STEP)
    found = search_of(fit, "command_hold")
    assert ticks_followed(found) is found
    assert ticks_sought(fit, 1e-9) is fit


def test_a_hold_of_no_length_has_no_ticks_to_be_sought():
    fit = estimate(held(), [recorded(0)], names=[PERIOD], noise=NOISE, max_step=STEP, iterations=0)
    fit = replace(fit, model=fit.model.with_values({PERIOD: 0.0}), values=np.zeros(1))
    assert ticks_sought(fit, 1e-9) is fit


def test_a_period_that_alone_is_free_is_followed_too():
    model = held(**{PERIOD: TRUE[PERIOD] + 2e-6})
    fixed = {name: replace(model.parameters[name], fixed=True) for name in model.free if name != PERIOD}
    fit = estimate(model.with_parameters(fixed), [recorded(0)], noise=NOISE, max_step=STEP)
    found = ticks_followed(search_of(fit, "command_hold"))
    assert abs(found.fit.model.value(PERIOD) - TRUE[PERIOD]) < 3.0 * found.fit.std[PERIOD] < 1e-5


def test_a_delay_that_is_found_below_zero_has_an_interval_too():
    # the command was logged later than it acted, by more than the interval reaches
    early, model = 3e-3, held(**{INPUT_DELAY: -3e-3})
    delay = replace(model.parameters[INPUT_DELAY], bounds=(-0.01, 1.0))
    record = recorded(0)
    assert record.command is not None
    logged = zero_order_hold(record.time + TRUE[INPUT_DELAY] + early, np.asarray(record.command(record.time)))
    late = replace(record, command=logged)
    fit = estimate(model.with_parameters({INPUT_DELAY: delay}), [late], noise=NOISE, max_step=STEP)
    found = ticks_followed(search_of(fit, "command_hold"))
    assert found.fit.model.value(INPUT_DELAY) == pytest.approx(-early, abs=1e-4)
    assert np.isfinite(found.fit.covariance).all()
    assert 1e-5 < found.fit.std[INPUT_DELAY] < 10.0 * SAMPLE
