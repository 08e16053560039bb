"""Linearisation: the paper's plant against its closed form, switches to the nanosecond, jumps of the force."""

from math import inf

import numpy as np
import pytest
from scipy.linalg import expm

from rhythmid.elements.element import Element, Parameter
from rhythmid.ltp.harmonic_state_space import harmonic_state_space
from rhythmid.ltp.limit_cycle import limit_cycle
from rhythmid.ltp.linearisation import linearise
from rhythmid.ltp.pumping import Pumping

PUMPING = Pumping.cosine(1.0, 1.0)


def late_damper(x, v, t, f, damping, threshold):
    return -damping * v if v > threshold else 0.0


LATE_DAMPER = Element(
    name="late_damper",
    slot="force",
    title="Damper that grips above a speed, with a jump of force",
    equation="F = −c v for v > v_t",
    parameters=(
        Parameter("damping", "N*s/m", "damping", bounds=(0.0, inf)),
        Parameter("threshold", "m/s", "speed", bounds=(0.0, inf)),
    ),
    kernel=late_damper,
    reference="test",
)


@pytest.fixture(scope="module")
def paper(rig):
    return linearise(limit_cycle(rig.hopper, PUMPING))


def test_the_papers_plant_gives_the_matrices_of_equation_13(paper) -> None:
    speed = paper.cycle.path(paper.time)[:, 1]
    s = (speed > 0).astype(float)
    a = paper.jacobian
    assert a[:, 0, :] == pytest.approx(np.tile([0.0, 1.0, 0.0], (len(s), 1)), abs=1e-6)
    assert a[:, 1, 0] == pytest.approx(-200.0, rel=1e-6)
    assert a[:, 1, 1] == pytest.approx(-2.0 * s, abs=1e-6)
    assert a[:, 1, 2] == pytest.approx(1.0, rel=1e-6)
    assert a[:, 2, :] == pytest.approx(np.tile([1.0, 0.0, 0.0], (len(s), 1)), abs=1e-6)


def test_switch_times_are_the_zeros_of_the_velocity(paper) -> None:
    assert len(paper.switches) == 2
    speed = paper.cycle.path(paper.switches)[:, 1]
    acceleration = paper.cycle.path.derivative()(paper.switches)[:, 1]
    assert np.abs(speed / acceleration) == pytest.approx(0.0, abs=5e-7)  # seconds
    assert (paper.switches[0] - paper.switches[1]) % 1.0 == pytest.approx(0.5125, abs=1e-4)


def test_fourier_coefficients_of_the_switching_function_are_those_of_its_switch_times(paper) -> None:
    off, on = paper.switches
    n = np.arange(1, 41)
    exact = (np.exp(-2j * np.pi * n * on) - np.exp(-2j * np.pi * n * (off + 1.0))) / (2j * np.pi * n)
    found = paper.fourier(40)[:, 1, 1] / -2.0
    assert found[41:] == pytest.approx(exact, abs=1e-7)
    assert found[40].real == pytest.approx(off + 1.0 - on, abs=1e-7)


def test_the_jacobian_integrates_to_the_monodromy_of_the_period_map(paper) -> None:
    # Floquet exponents of the harmonic state space are logarithms of the multipliers
    space = harmonic_state_space(paper, 30)
    exponents = np.linalg.eigvals(space.a_minus_n)
    central = exponents[np.argsort(np.abs(exponents.imag))][:2]
    found, expected = np.exp(central), paper.cycle.multipliers  # a conjugate pair, in either order
    assert found[np.argsort(found.imag)] == pytest.approx(expected[np.argsort(expected.imag)], rel=2e-4)


def test_a_smooth_machine_has_no_switches(rig, catalogue) -> None:
    smooth = rig.hopper.without("switched_damper").with_element(catalogue["viscous_damper"], {"damping": 1.0})
    stiffer = smooth.with_element(catalogue["cubic_stiffness"], {"coefficient": 1e5})
    assert len(linearise(limit_cycle(stiffer, PUMPING)).switches) == 0


def test_a_jump_of_the_force_acts_as_an_impulse(rig) -> None:
    """The Floquet multipliers against the product of exponentials and of the two saltation matrices, written down."""
    damping, threshold = 2.0, 0.015
    model = rig.hopper.without("switched_damper").with_element(
        LATE_DAMPER, {"damping": damping, "threshold": threshold}
    )
    cycle = limit_cycle(model, PUMPING)
    found = linearise(cycle)
    assert len(found.switches) == len(found.impulses) == 2
    on, off = (impulse.time for impulse in found.impulses)
    assert cycle.path([on, off])[:, 1] == pytest.approx(threshold, abs=1e-6)

    def gliding(time: float) -> float:
        """Acceleration without the damper."""
        return -200.0 * (cycle.path(time)[0] - 0.2) - 9.81 + np.cos(2 * np.pi * time)

    def flow(stance: float, time: float) -> np.ndarray:
        return expm(np.array([[0.0, 1.0], [-200.0, -damping * stance]]) * time)

    def saltation(before: float, after: float) -> np.ndarray:
        return np.array([[1.0, 0.0], [0.0, after / before]])

    gripping = damping * threshold
    jump_on = saltation(gliding(on), gliding(on) - gripping)
    jump_off = saltation(gliding(off) - gripping, gliding(off))
    product = flow(0, 1.0 - off) @ jump_off @ flow(1, off - on) @ jump_on @ flow(0, on)
    exponents = np.linalg.eigvals(harmonic_state_space(found, 40).a_minus_n)
    central = np.exp(exponents[np.argsort(np.abs(exponents.imag))][:2])
    assert np.abs(central) == pytest.approx(np.abs(np.linalg.eigvals(product)), rel=5e-3)
