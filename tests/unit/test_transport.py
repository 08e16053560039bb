"""When commands act and how old measurements are: by the delays of a model, whoever asks."""

import numpy as np
import pytest

from machines import CATALOGUE, hopper
from rhythmid.model import Model
from rhythmid.simulation.plant import Plant
from rhythmid.simulation.signal import zero_order_hold
from rhythmid.simulation.simulate import simulate
from rhythmid.simulation.transport import CommandPath, command_delay, delayed_command, physical_times

PERIOD, N = 1e-3, 1500
TIME = PERIOD * np.arange(N)
JITTER = {"std": 0.005, "seed": 3.0}
INPUT, MEASUREMENT = 0.0133, 0.0041  # [s]


def machine(**elements: dict[str, float]) -> Model:
    """The hopper, delayed, with these elements."""
    model = hopper().with_values({"input_delay.delay": INPUT, "measurement_delay.delay": MEASUREMENT})
    for name, values in elements.items():
        model = model.with_element(CATALOGUE[name], values)
    return model


def test_a_command_is_delayed_before_it_waits_for_the_tick():
    late = command_delay(machine(command_hold={"period": 0.02}), np.array([0.0, 0.006, 0.008, 0.03]))
    assert late is not None  # it arrives at 13.3, 19.3, 21.3 and 43.3 ms
    np.testing.assert_allclose(late, [0.02, 0.014, 0.032, 0.03], atol=1e-12)


def test_a_command_never_overtakes_an_earlier_one():
    alone = CATALOGUE["command_jitter"].delay
    assert alone is not None and np.any(np.diff(TIME + alone(TIME, **JITTER)) < 0.0)
    for more in ({}, {"command_hold": {"period": 0.004}}):
        late = command_delay(machine(command_jitter=JITTER, **more), TIME)
        assert late is not None and np.all(np.diff(TIME + late) >= 0.0)


def test_a_measurement_never_overtakes_an_earlier_one():
    taken = physical_times(machine(measurement_jitter=JITTER), TIME)
    assert np.all(np.diff(taken) >= 0.0)
    assert np.all(taken <= TIME - MEASUREMENT)


@pytest.mark.parametrize(
    "elements",
    [
        {},
        {"input_delay_drift": {"rate": 0.003}},
        {"command_jitter": JITTER},
        {"command_jitter": JITTER, "command_hold": {"period": 0.004}},
    ],
)
def test_commands_act_at_the_same_times_fed_whole_or_in_chunks(elements):
    model = machine(**elements)
    path = CommandPath(model)
    chunks = np.concatenate([path.times(part) for part in np.split(TIME, [1, 5, 5, 400])])
    np.testing.assert_array_equal(chunks, CommandPath(model).times(TIME))
    late, moved = command_delay(model, TIME), delayed_command(model, zero_order_hold(TIME, np.sin(TIME)))
    assert late is not None and moved is not None
    np.testing.assert_allclose(TIME + late, chunks, atol=1e-12)
    np.testing.assert_array_equal(moved.x[:-1], chunks)


def test_without_a_delaying_element_commands_act_at_once():
    model = hopper().without("input_delay")
    assert command_delay(model, TIME) is None
    np.testing.assert_array_equal(CommandPath(model).times(TIME), TIME)


def test_the_plant_applies_the_delays_of_the_command_path_as_the_simulator_does():
    model = hopper().without("input_delay").without("measurement_delay")
    for name, values in (("command_jitter", JITTER), ("input_delay_drift", {"rate": 0.01})):
        model = model.with_element(CATALOGUE[name], values)
    effort, start = 5.0 * np.sin(20.0 * TIME), (0.25, 0.0)
    plant = Plant(model, round(PERIOD * 1e9), initial=start)
    plant.push_many(np.rint(TIME * 1e9).astype(np.int64), effort)
    samples = plant.advance(round(TIME[-1] * 1e9))
    there = simulate(model, TIME, zero_order_hold(TIME, effort), initial=start)
    np.testing.assert_allclose(samples.position, there.output, atol=1e-9)
