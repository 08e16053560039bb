"""Shape: effects that end at the edge of what they may be."""

import pytest

from machines import CATALOGUE, hopper
from rhythmid.diagnose.constants import EDGE
from rhythmid.diagnose.shape import shape_of
from rhythmid.elements.element import Element, Scales

SIZES = Scales(
    position=0.02, velocity=0.1, effort=4.0, centre=0.1, low=0.07, high=0.13, mass=1.0, stiffness=200.0,
    frequency=2.0, duration=10.0, period=1e-2, forcing_frequency=2.0,
)  # fmt: skip


def shape(
    name: str, values: dict[str, float], sizes: Scales = SIZES, element: Element | None = None
) -> dict[str, float]:
    """Statistics of one element with these values, added to the hopper."""
    model = hopper().with_element(element or CATALOGUE[name], values)
    return shape_of(model, (name,), sizes)


@pytest.mark.parametrize(("share", "edge"), [(0.5, True), (0.4999, True), (0.49, False), (0.2, False)])
def test_a_ripple_as_long_as_it_may_be_is_a_spring(share, edge):
    ripple = CATALOGUE["position_ripple"].within(SIZES)
    found = shape("position_ripple", {"amplitude": 0.1, "wavelength": share * 0.06}, element=ripple)
    assert (found["within_bounds"] < EDGE) is edge


@pytest.mark.parametrize(
    ("share", "damping", "edge"), [(1.0, 0.1, True), (0.5, 1.0, True), (0.5, 0.1, False), (0.5, 0.0, False)]
)
def test_a_mode_as_fast_as_the_samples_or_overdamped_is_something_else(share, damping, edge):
    values = {"mass": 0.01, "frequency": share * 0.5 / SIZES.period, "damping_ratio": damping}
    found = shape("second_mode", values, element=CATALOGUE["second_mode"].within(SIZES))
    assert (found["within_bounds"] < EDGE) is edge


@pytest.mark.parametrize(
    "name", ["coulomb_friction", "asymmetric_coulomb_friction", "load_dependent_friction"]
)
@pytest.mark.parametrize(("times", "damper"), [(2.0, True), (1.9, False), (0.01, False)])
def test_dry_friction_that_turns_over_all_speeds_is_a_damper(name, times, damper):
    friction = CATALOGUE[name].within(SIZES)
    values = {one.name: 0.1 for one in friction.parameters} | {"transition": times * SIZES.velocity}
    assert (shape(name, values, element=friction)["within_bounds"] < EDGE) is damper


def test_of_several_effects_the_worst_statistic_is_told_and_labels_without_an_element_have_none():
    model = hopper().with_element(CATALOGUE["freeplay"], {"gap": 0.0})
    model = model.with_element(CATALOGUE["viscous_damper"], {"damping": 0.1})
    assert shape_of(model, ("freeplay", "viscous_damper"), SIZES)["within_bounds"] == 0.0
    assert shape_of(model, ("viscous_damper",), SIZES)["within_bounds"] > EDGE
    assert shape_of(model, ("inertia.mass",), SIZES) == {}


@pytest.mark.parametrize(("ratio", "edge"), [(100.0, True), (1.0, True), (1.5, False), (20.0, False)])
def test_a_stribeck_friction_without_kinetic_friction_or_without_a_rise_is_something_else(ratio, edge):
    stribeck = CATALOGUE["stribeck_friction"].within(SIZES)
    values = {"force": 0.1, "static_ratio": ratio, "stribeck_speed": 0.02, "transition": 0.002}
    assert (shape("stribeck_friction", values, element=stribeck)["within_bounds"] < EDGE) is edge


@pytest.mark.parametrize(
    ("name", "values"),
    [
        ("coulomb_friction", {"force": 1.0, "transition": 0.002}),
        ("cubic_stiffness", {"coefficient": 1e4}),
        ("stiffness_jump", {"change": 0.1, "time": 5.0}),
    ],
)
def test_an_effect_without_a_size_is_the_model_without_it(name, values):
    absent = {**values, CATALOGUE[name].size: 0.0}
    element = CATALOGUE[name].within(SIZES)
    assert shape(name, values, element=element)["within_bounds"] > EDGE
    assert shape(name, absent, element=element)["within_bounds"] == 0.0
