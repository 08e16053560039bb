"""Free runs over records: delays of the command path in order, surrogates for held commands, where elements start."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.interpolate import PPoly

from machines import CATALOGUE, hopper
from rhythmid.diagnose.search.refit import fine_enough
from rhythmid.identify.free_run import prepare_run, start_of, sufficient
from rhythmid.identify.series import Series
from rhythmid.model import Model
from rhythmid.simulation.signal import spline, zero_order_hold
from rhythmid.simulation.simulate import simulate

PERIOD, N = 1e-3, 1500
TIME = PERIOD * np.arange(N)
COMMAND = zero_order_hold(TIME, np.sin(1.0 + 2 * np.pi * 3.1 * TIME**2))
FORCING = spline(TIME, np.cos(2 * np.pi * TIME))
DELAYED = {"input_delay.delay": 0.0133, "measurement_delay.delay": 0.0041}


def series(
    block: int = 1, begin: float = 0.0, command: PPoly | None = COMMAND, forcing: PPoly | None = FORCING
) -> Series:
    """A measurement of nothing, under the command and the forcing."""
    time = begin + TIME
    return Series("made", time, np.zeros(N), command, forcing, block, np.ones(N // block, bool), PERIOD)


def machine(**elements: dict[str, float]) -> Model:
    """The hopper, delayed, with these elements."""
    model = hopper().with_values(DELAYED)
    for name, values in elements.items():
        model = model.with_element(CATALOGUE[name], values)
    return model


@pytest.mark.parametrize("block", [1, 5])
def test_a_delay_and_a_hold_act_as_in_the_simulator(block):
    model, one = machine(command_hold={"period": 0.0217}), series(block)
    run = prepare_run(model, [one], 1e-3)
    start = start_of(model, run, 0, 0.15, 0.1)
    outputs = run.outputs(model, [start])
    assert outputs is not None
    expected = simulate(model, one.centres, COMMAND, FORCING, start, 1e-3).output
    np.testing.assert_allclose(outputs[0], one.of_block(expected), atol=1e-12)


@pytest.mark.parametrize(
    ("name", "values"),
    [
        ("backlash", {"width": 0.2}),
        ("actuator_rate_limit", {"rate": 5.0}),
        ("reference_rate_limit", {"rate": 5.0}),
    ],
)
def test_play_and_rate_limits_see_every_step_of_a_held_command(name, values):
    run = prepare_run(machine(**{name: values}), [series(5)])
    assert not run.smooth


@pytest.mark.parametrize(
    ("name", "values"),
    [("actuator_saturation", {"limit": 2.0}), ("coulomb_friction", {"force": 0.1, "transition": 0.01})],
)
def test_what_remembers_no_extreme_is_driven_by_the_smooth_surrogate(name, values):
    run = prepare_run(machine(**{name: values}), [series(5)])
    assert run.smooth


@pytest.mark.parametrize("step", [PERIOD, 0.5625 * PERIOD])
def test_wherever_a_jump_of_the_command_falls_within_a_step_it_acts_in_full(step):
    jump = zero_order_hold(TIME, 8.0 * (TIME >= 0.4))
    model, one = machine(sensor_lag={"time_constant": 0.017}), series(9, command=jump)
    start = np.array([0.15, 0.0, 0.15])
    for late in DELAYED["input_delay.delay"] + PERIOD * np.linspace(0.0, 1.0, 12):
        delayed = model.with_values({"input_delay.delay": late})
        outputs = prepare_run(delayed, [one], step).outputs(delayed, [start])
        assert outputs is not None
        exact = one.of_block(simulate(delayed, one.centres, jump, FORCING, start, 1e-4).output)
        assert np.ptp(exact) > 0.05
        np.testing.assert_allclose(outputs[0][4:-4], exact[4:-4], atol=1.5e-6)


@pytest.mark.parametrize(
    ("name", "values", "state", "forced"),
    [
        ("command_lag", {"time_constant": 0.01}, "lagged", 0.0),
        ("actuator_lag", {"time_constant": 0.01}, "lagged", 1.0),
        ("backlash", {"width": 0.2}, "memory", 1.0),
        ("actuator_rate_limit", {"rate": 5.0}, "memory", 1.0),
    ],
)
def test_lags_play_and_rate_limits_start_at_the_signal_that_acts_there(name, values, state, forced):
    model = machine(**{name: values})
    run = prepare_run(model, [series(1, 0.4005), series(1, 0.009)])
    place = run.compiled.layout.states.index(f"{name}.{state}")
    taken = 0.4005 - DELAYED["measurement_delay.delay"]
    command, forcing = COMMAND(taken - DELAYED["input_delay.delay"]), FORCING(taken)
    assert abs(command) > 0.1 and abs(command - COMMAND(taken)) > 0.1
    start = start_of(model, run, 0, 0.15, -0.3)
    assert start[:2].tolist() == [0.15, -0.3]
    assert start[place] == pytest.approx(command + forced * forcing)
    before = start_of(model, run, 1, 0.15, 0.0)  # 4.9 ms after the first command was sent, none has arrived
    assert before[place] == pytest.approx(forced * FORCING(0.009 - DELAYED["measurement_delay.delay"]))


def test_steps_are_halved_until_a_further_halving_changes_less_than_the_tolerance():
    model, one = machine(), series(block=50)
    run = prepare_run(model, [one])
    start = start_of(model, run, 0, 0.15, 0.1)
    found = sufficient(run, model, [start], 1e-6)
    outputs = [
        replace(found, max_step=found.max_step * share).outputs(model, [start]) for share in (2.0, 1.0, 0.5)
    ]
    twice, once, half = (one[0] for one in outputs if one is not None)
    assert found.max_step < run.max_step
    assert np.sqrt(np.mean((once - half) ** 2)) < 1e-6 <= np.sqrt(np.mean((twice - once) ** 2))
    assert sufficient(found, model, [start], 1e-6) is found


def test_no_step_ends_at_the_knots_of_a_smooth_command():
    smooth = spline(TIME, np.sin(1.0 + 2 * np.pi * 3.1 * TIME**2))
    model, one = machine(), series(block=5, command=smooth)
    run = prepare_run(model, [one])
    assert run.smooth and run.max_step == pytest.approx(5 * PERIOD)
    start = start_of(model, run, 0, 0.15, 0.1)
    outputs = run.outputs(model, [start])
    assert outputs is not None
    expected = simulate(model, one.centres, smooth, FORCING, start, 1e-4).output
    np.testing.assert_allclose(outputs[0], one.of_block(expected), atol=2e-5)


def test_what_remembers_extremes_is_driven_by_a_smooth_command_as_it_is():
    smooth = spline(TIME, np.sin(1.0 + 2 * np.pi * 3.1 * TIME**2))
    assert prepare_run(machine(backlash={"width": 0.1}), [series(block=5, command=smooth)]).smooth


@pytest.mark.parametrize(("ticks", "smooth"), [(1, False), (2, True), (10, True)])
def test_a_held_command_that_changes_often_between_samples_has_a_smooth_surrogate(ticks, smooth):
    time = np.arange(0.0, 1.5, PERIOD * ticks)
    one = Series(
        "made", time, np.zeros(len(time)), COMMAND, FORCING, 1, np.ones(len(time), bool), PERIOD * ticks
    )
    model = machine()
    run = prepare_run(model, [one], PERIOD)
    assert run.smooth == smooth
    start = start_of(model, run, 0, 0.15, 0.1)
    outputs = run.outputs(model, [start])
    assert outputs is not None
    expected = simulate(model, one.centres, COMMAND, FORCING, start, 1e-4).output
    np.testing.assert_allclose(outputs[0], expected, atol=2e-5)


def test_steps_are_halved_six_times_at_most_however_often_a_run_is_looked_at():
    model, one = machine(), series(block=10)
    run = prepare_run(model, [one])
    start = start_of(model, run, 0, 0.15, 0.1)
    for _ in range(3):  # nothing is fine enough for no noise at all
        run = fine_enough(run, model, [start], 0.0)
        assert run.max_step == pytest.approx(run.longest_step / 64)
