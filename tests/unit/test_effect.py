"""An element along a given trajectory does what it does in the simulator."""

from dataclasses import replace

import numpy as np
import pytest

from machines import CATALOGUE, hopper
from rhythmid.errors import InputError
from rhythmid.simulation.compiled import compile_model
from rhythmid.simulation.effect import Path, effect_along
from rhythmid.simulation.signal import first_order_hold
from rhythmid.simulation.simulate import simulate, start_states

T = np.arange(4000) * 1e-3
X = 0.2 + 0.01 * np.sin(2 * np.pi * 1.3 * T)
V = 0.01 * 2 * np.pi * 1.3 * np.cos(2 * np.pi * 1.3 * T)
F = np.cos(2 * np.pi * T)
PATH = Path(T, X, V, F, -200.0 * (X - 0.2), F)


def test_a_memoryless_force_is_its_formula():
    got = effect_along(CATALOGUE["cubic_stiffness"], {"coefficient": 1000.0}, hopper(), PATH)
    assert np.allclose(got, -1000.0 * (X - 0.2) ** 3, atol=1e-12)


def test_a_parameter_without_a_value_is_refused_by_name():
    with pytest.raises(InputError, match="coefficient"):
        effect_along(CATALOGUE["cubic_stiffness"], {}, hopper(), PATH)


def test_a_relaxing_force_is_the_filtered_velocity():
    got = effect_along(
        CATALOGUE["viscoelastic_relaxation"], {"stiffness": 5.0, "time_constant": 0.08}, hopper(), PATH
    )
    omega = 2 * np.pi * 1.3
    gain = 5.0 * 1j * omega * 0.08 / (1 + 1j * omega * 0.08)
    expected = -np.imag(gain * 0.01 * np.exp(1j * omega * T))
    assert np.abs(got - expected)[2000:].max() < 2e-4 * np.abs(expected).max() + 1e-6


def test_an_actuator_s_effect_is_the_change_of_its_signal():
    got = effect_along(CATALOGUE["actuator_deadband"], {"threshold": 0.1}, hopper(), PATH)
    assert np.abs(got).max() == pytest.approx(0.1, rel=0.05)


@pytest.mark.parametrize(
    ("name", "values"), [("backlash", {"width": 0.3}), ("actuator_rate_limit", {"rate": 5.0})]
)
def test_what_an_actuator_remembers_along_a_path_is_what_it_does_in_the_simulator(name, values):
    model = hopper().with_element(CATALOGUE[name], values)
    run = simulate(
        model,
        T,
        first_order_hold(T, F),
        None,
        start_states(model, compile_model(model), 0.2, 0.0, F[0]),
        1e-3,
    )
    got = effect_along(CATALOGUE[name], values, hopper(), PATH)
    assert got == pytest.approx(run.effort - F, abs=1e-12)
    assert np.abs(got).max() > 0.1


def test_a_gear_s_friction_along_a_path_is_loaded_by_the_model_s_forces_as_in_the_simulator():
    values = {"coefficient": 0.1, "external_ratio": 0.5, "transition": 1e-3}
    got = effect_along(CATALOGUE["transmitted_load_friction"], values, hopper(), PATH)
    load = -200.0 * (X - 0.2) - 9.81
    assert got == pytest.approx(-0.1 * np.abs(F - 0.5 * load) * np.tanh(V / 1e-3), abs=2e-3)
    given = effect_along(
        CATALOGUE["transmitted_load_friction"], values, hopper(), replace(PATH, load=0.0 * F)
    )
    assert given == pytest.approx(-0.1 * np.abs(F) * np.tanh(V / 1e-3), abs=2e-3)
