"""Static laws: of which one quantity an effect is a curved function."""

import pytest

from machines import CATALOGUE, hopper
from rhythmid.diagnose.static_law import law_of
from rhythmid.elements.element import Scales

SIZES = Scales(
    position=0.01, velocity=0.1, effort=2.0, centre=0.1, low=0.07, high=0.13, mass=1.0, stiffness=200.0,
    frequency=2.0, duration=20.0, period=1e-3, forcing_frequency=2.0,
)  # fmt: skip


@pytest.mark.parametrize(
    ("name", "argument"),
    [
        ("cubic_stiffness", "position"),
        ("position_ripple", "position"),
        ("bilinear_stiffness", "position"),
        ("coulomb_friction", "velocity"),
        ("quadratic_drag", "velocity"),
        ("actuator_saturation", "signal"),
        ("sensor_nonlinearity", "signal"),
        ("viscous_damper", ""),  # straight: the nominal model's own damping says the same
        ("sensor_gain", ""),
        ("position_dependent_damping", ""),  # of two quantities
        ("load_dependent_friction", ""),
        ("ground_contact_loss", ""),
        ("periodic_disturbance", ""),  # of time
        ("stiffness_drift", ""),  # of time, too
        ("actuator_fade", ""),
        ("elastoplastic_hysteresis", ""),  # remembers
        ("sensor_lag", ""),
        ("input_delay_drift", ""),
    ],
)
def test_a_static_law_is_a_curved_function_of_one_quantity(name, argument):
    element = CATALOGUE[name]
    assert element.starts is not None
    law = law_of(element, element.starts(SIZES)[0], hopper(), SIZES)
    assert (law[0] if law else "") == argument


def test_a_stop_that_damps_a_little_is_a_law_of_the_position_all_the_same():
    stop = {"stiffness": 1e4, "damping_ratio": 0.1, "position": 0.08, "side": -1.0}
    law = law_of(CATALOGUE["end_stop_contact"], stop | {"mass": 1.0}, hopper(), SIZES)
    assert law is not None and law[0] == "position"
    assert law_of(CATALOGUE["end_stop_contact"], stop | {"damping_ratio": 5.0}, hopper(), SIZES) is None
