"""The plant: the simulator fed piece by piece, the same whatever the pieces."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as some

import rhythmid
from rhythmid.elements.catalogue import load_catalogue
from rhythmid.errors import InputError
from rhythmid.experiment import Forcing, Noise, plant_model
from rhythmid.model import Model
from rhythmid.simulation.plant import Plant, Samples, settled
from rhythmid.simulation.signal import zero_order_hold
from rhythmid.simulation.simulate import simulate

CATALOGUE = load_catalogue()
PAPER = Model.load(Path(rhythmid.__file__).parent / "models" / "paper_hopper.yaml", CATALOGUE)
HOPPER = plant_model(PAPER, Forcing(), Noise(), CATALOGUE)
NOISY = plant_model(
    PAPER.with_element(CATALOGUE["actuator_lag"], {"time_constant": 0.003}),
    Forcing(),
    Noise(measurement_std=1e-4, correlation=0.7, quantisation=1e-5),
    CATALOGUE,
)
REMEMBERING = plant_model(
    PAPER.with_element(CATALOGUE["backlash"], {"width": 0.3}).with_element(
        CATALOGUE["actuator_rate_limit"], {"rate": 300.0}
    ),
    Forcing(),
    Noise(),
    CATALOGUE,
)
LATE_DRIVE = plant_model(
    PAPER.with_element(CATALOGUE["actuator_delay"], {"delay": 0.0123}),
    Forcing(),
    Noise(),
    CATALOGUE,
)
LATE_LOOP = plant_model(
    PAPER.with_element(CATALOGUE["position_control"], {"proportional": 150.0, "derivative": 4.0})
    .with_element(CATALOGUE["feedback_delay"], {"delay": 0.0071})
    .with_element(CATALOGUE["actuator_delay"], {"delay": 0.0004}),
    Forcing(),
    Noise(),
    CATALOGUE,
)
MS = 1_000_000
COUNT = 200
LATE = np.arange(COUNT, dtype=np.int64) * MS + 40_300_001
COMMANDS = np.random.default_rng(0).standard_normal(COUNT)


def together(parts: list[Samples]) -> dict[str, np.ndarray]:
    return {
        name: np.concatenate([getattr(part, name) for part in parts])
        for name in ("stamp_ns", "position", "velocity", "effort", "forcing")
    }


def in_one_go(model: Model, initial=(0.15, 0.0)) -> dict[str, np.ndarray]:
    plant = Plant(model, MS, seed=3, initial=initial)
    plant.push_many(LATE, COMMANDS)
    return together([plant.advance((COUNT - 1) * MS)])


@pytest.mark.parametrize(
    "model",
    [HOPPER, NOISY, REMEMBERING, LATE_DRIVE, LATE_LOOP],
    ids=[
        "hopper",
        "lag, noise and rounding",
        "play and a limit of rate",
        "actuator delay",
        "two delays in a loop",
    ],
)
@given(cuts=some.lists(some.integers(0, (COUNT - 1) * MS), max_size=30), early=some.integers(0, 5 * MS))
def test_every_chunking_gives_the_same_bits(model, cuts, early):
    """Commands come one by one, as late as they may or earlier; samples are asked for at any time."""
    plant = Plant(model, MS, seed=3, initial=(0.15, 0.0))
    parts, pushed = [], 0
    for until in [*sorted(cuts), (COUNT - 1) * MS]:
        while pushed < COUNT and LATE[pushed] <= until + early:
            plant.push(int(LATE[pushed]), float(COMMANDS[pushed]))
            pushed += 1
        parts.append(plant.advance(until))
    for name, expected in in_one_go(model).items():
        np.testing.assert_array_equal(together(parts)[name], expected, err_msg=name)


def test_a_settled_plant_with_a_dead_time_goes_on_as_it_has_run():
    """A drive that is late by tau moves the uncommanded machine as it moved tau earlier."""
    late = Plant(LATE_DRIVE, MS).advance(1000 * MS).position
    prompt = Plant(HOPPER, 100_000).advance(1000 * MS).position
    assert late[13:] == pytest.approx(prompt[7:-123:10][: len(late) - 13], abs=1e-9)


def test_the_plant_equals_the_simulator():
    samples = in_one_go(HOPPER)
    times = np.arange(COUNT) * 1e-3
    run = simulate(HOPPER, times, zero_order_hold(LATE * 1e-9, COMMANDS), initial=(0.15, 0.0))
    np.testing.assert_allclose(samples["position"], run.position, rtol=0, atol=1e-15)
    np.testing.assert_allclose(samples["velocity"], run.velocity, rtol=0, atol=1e-13)
    np.testing.assert_allclose(samples["effort"], run.effort, rtol=0, atol=1e-13)
    np.testing.assert_array_equal(samples["stamp_ns"], np.arange(COUNT) * MS)


def test_the_models_own_transport_delays_are_left_to_the_injectors():
    delayed = HOPPER.with_values({"input_delay.delay": 0.04, "measurement_delay.delay": 0.05})
    np.testing.assert_array_equal(in_one_go(delayed)["position"], in_one_go(HOPPER)["position"])


def test_no_command_is_zero_command_and_the_forcing_is_its_formula():
    plant = Plant(HOPPER, MS, initial=(0.15, 0.0))
    samples = plant.advance(50 * MS)
    np.testing.assert_allclose(samples.forcing, np.cos(2 * np.pi * np.arange(51) * 1e-3), atol=1e-15)
    np.testing.assert_allclose(samples.effort, samples.forcing, atol=1e-15)


def test_samples_are_given_out_once():
    plant = Plant(HOPPER, MS, initial=(0.15, 0.0))
    assert plant.advance(10 * MS + 999_999).stamp_ns.tolist() == [k * MS for k in range(11)]
    assert len(plant.advance(10 * MS + 999_999).stamp_ns) == 0
    assert plant.advance(12 * MS).stamp_ns.tolist() == [11 * MS, 12 * MS]


def test_the_settled_machine_is_on_its_limit_cycle():
    """A period later it is where it was; the paper's cycle measures 12.4 mm from peak to peak."""
    plant = Plant(HOPPER, MS)
    samples = plant.advance(3000 * MS)
    np.testing.assert_allclose(samples.position[:1000], samples.position[2000:3000], atol=1e-11)
    assert np.ptp(samples.position) == pytest.approx(12.4e-3, abs=0.05e-3)


def test_without_forcing_the_settled_machine_rests():
    """On the spring under its weight, x0 - m g / k. The hopper is damped only upwards, so this takes some time."""
    resting, _ = settled(PAPER)
    np.testing.assert_allclose(resting, [0.2 - 9.81 / 200, 0.0], atol=1e-9)


def test_noise_is_the_seeds():
    first, again = in_one_go(NOISY)["position"], in_one_go(NOISY)["position"]
    np.testing.assert_array_equal(first, again)
    other = Plant(NOISY, MS, seed=4, initial=(0.15, 0.0))
    other.push_many(LATE, COMMANDS)
    assert np.any(other.advance((COUNT - 1) * MS).position != first)


@pytest.mark.parametrize("stamps", [[5, 5], [5, 4], [3, 9]])
def test_commands_out_of_order_are_refused(stamps):
    plant = Plant(HOPPER, MS, initial=(0.15, 0.0))
    plant.push(3, 0.0)
    with pytest.raises(InputError, match="in the order of their stamps"):
        plant.push_many(np.array(stamps), np.zeros(2))


@pytest.mark.parametrize("effort", [float("nan"), float("inf")])
def test_a_command_that_is_no_finite_number_is_refused(effort):
    with pytest.raises(InputError, match="a command is not a finite number"):
        Plant(HOPPER, MS, initial=(0.15, 0.0)).push(7, effort)


def test_a_plant_that_diverges_is_refused_with_the_time():
    plant = Plant(HOPPER.with_values({"linear_spring.stiffness": -1e7}), MS, initial=(0.15, 0.0))
    with pytest.raises(InputError, match=r"the plant diverges at t = [0-9.]+ s"):
        plant.advance(1000 * MS)
    with pytest.raises(InputError, match="the model diverges under its forcing"):
        Plant(HOPPER.with_values({"linear_spring.stiffness": -1e7}), MS)
