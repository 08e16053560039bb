"""Limit cycles against long simulations and closed forms."""

import numpy as np
import pytest

from rhythmid.errors import InputError
from rhythmid.ltp.limit_cycle import limit_cycle
from rhythmid.ltp.pumping import Pumping
from rhythmid.simulation.signal import spline
from rhythmid.simulation.simulate import simulate

PUMPING = Pumping.cosine(1.0, 1.0)


def test_the_papers_limit_cycle_has_the_papers_size(rig) -> None:
    cycle = limit_cycle(rig.hopper, PUMPING)
    assert np.ptp(cycle.output) == pytest.approx(12.4e-3, abs=0.05e-3)
    assert np.mean(cycle.states[:-1, 1] > 0) == pytest.approx(0.512, abs=1e-3)


def test_it_is_what_a_long_simulation_settles_to(rig) -> None:
    pumping = Pumping(1.25, np.array([0.0, 0.8, 0.3j]))
    cycle = limit_cycle(rig.hopper, pumping)
    time = np.arange(-50, 64_000 + 50) * 1e-3
    forcing = spline(time, pumping(time))
    stamps = np.arange(64_001) * 1e-3
    settled = simulate(rig.hopper, stamps, None, forcing, (0.2, 0.0)).states[-801:]
    assert cycle.path(np.arange(801) * 1e-3) == pytest.approx(settled, abs=1e-7)


def test_multipliers_and_ring_down_are_those_of_the_mean_damping(rig) -> None:
    cycle = limit_cycle(rig.hopper, PUMPING)
    # Liouville: the product of the multipliers is exp(-∫ c s(t) dt / m)
    assert np.prod(cycle.multipliers).real == pytest.approx(np.exp(-2.0 * 0.51250), rel=1e-4)
    assert cycle.ring_down == pytest.approx(2.0 / 1.025, rel=1e-3)


def test_a_linear_machine_follows_its_frequency_response(rig) -> None:
    model = rig.hopper.with_values({"switched_damper.flight": 2.0})
    cycle = limit_cycle(model, PUMPING)
    omega = 2 * np.pi
    assert cycle.harmonics(1)[1] == pytest.approx(0.5 / (200 - omega**2 + 2j * omega), rel=1e-7)
    assert cycle.harmonics(0)[0].real == pytest.approx(0.2 - 9.81 / 200, rel=1e-9)


def test_without_forcing_the_machine_rests(rig) -> None:
    cycle = limit_cycle(rig.hopper, Pumping(1.0, np.zeros(2, dtype=complex)))
    assert cycle.output == pytest.approx(0.2 - 9.81 / 200, abs=1e-9)


def test_a_models_own_forcing_serves_as_well(rig, catalogue) -> None:
    own = rig.hopper.with_element(catalogue["periodic_forcing"], {"amplitude": 1.0, "frequency": 1.0})
    still = Pumping(1.0, np.zeros(2, dtype=complex))
    assert limit_cycle(own, still).output == pytest.approx(limit_cycle(rig.hopper, PUMPING).output, abs=1e-11)


def test_a_models_own_states_are_part_of_the_cycle(rig, catalogue) -> None:
    lagging = rig.hopper.with_element(catalogue["actuator_lag"], {"time_constant": 0.02})
    cycle = limit_cycle(lagging, PUMPING)
    assert cycle.states.shape[1] == 3
    lag = cycle.states[:-1, 2]
    assert np.fft.rfft(lag)[1] / 500 == pytest.approx(1 / (1 + 0.02j * 2 * np.pi), rel=1e-4)


def test_a_machine_without_damping_has_no_attracting_cycle_to_ring_down_to(rig) -> None:
    undamped = rig.hopper.with_values({"switched_damper.stance": 0.0})
    try:
        assert limit_cycle(undamped, PUMPING).ring_down > 1e4
    except InputError as refusal:
        assert "limit cycle" in str(refusal)


def test_a_diverging_model_is_refused_with_one_line(rig, catalogue) -> None:
    falling = rig.hopper.with_element(catalogue["cubic_stiffness"], {"coefficient": -1e5})
    with pytest.raises(InputError, match="diverges|no limit cycle"):
        limit_cycle(falling, PUMPING)
