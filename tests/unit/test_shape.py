"""Shape: effects that bend beyond the records, end at the edge of what they may be, or keep step with the forcing."""

import math
from dataclasses import replace
from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest

from machines import CATALOGUE, hopper
from rhythmid.diagnose.constants import EDGE
from rhythmid.diagnose.search.score_tests import Trajectories
from rhythmid.diagnose.shape import shape_of
from rhythmid.elements.element import Element, Scales
from rhythmid.simulation.effect import Path

SIZES = Scales(
    position=0.02, velocity=0.1, effort=4.0, centre=0.1, low=0.07, high=0.13, mass=1.0, stiffness=200.0,
    frequency=2.0, duration=10.0, period=1e-2, forcing_frequency=2.0,
)  # fmt: skip
TIME = 0.01 * np.arange(1000)
PHASE = 2.0 * np.pi * TIME


def motion(base: float = 0.0, effort: float = 6.0) -> Trajectories:
    """A motion between 0.07 and 0.13 m, pushed by up to `effort` [N]; `base` is where the leg stands [m]."""
    position = 0.10 + 0.03 * np.sin(PHASE)
    path = Path(TIME, position, 0.2 * np.cos(PHASE), effort * np.cos(1.3 * PHASE), np.sin(PHASE), position)
    leg = replace(path, position=path.position - base)
    known = SimpleNamespace(paths=(path,), legs=(leg,), commands=(path.effort,))
    return cast(Trajectories, known)


def shape(
    name: str,
    values: dict[str, float],
    known: Trajectories | None = None,
    sizes: Scales = SIZES,
    element: Element | None = None,
) -> dict[str, float]:
    """Statistics of one element with these values, added to the hopper."""
    model = hopper().with_element(element or CATALOGUE[name], values)
    return shape_of(model, (name,), known or motion(), sizes)


@pytest.mark.parametrize(
    ("name", "values", "beyond"),
    [
        ("freeplay", {"gap": 0.2}, False),
        ("freeplay", {"gap": 0.02}, True),  # under the weight the spring is always on one side of the gap
        ("freeplay", {"gap": 0.9}, True),  # the motion never leaves the gap
        ("end_stop_contact", {"stiffness": 1e4, "position": 0.0701, "side": -1.0}, False),  # just touched
        ("end_stop_contact", {"stiffness": 1e4, "position": 0.03, "side": -1.0}, True),
        ("actuator_saturation", {"limit": 6.0}, False),  # what is seen of the force ends at the limit
        ("actuator_saturation", {"limit": 50.0}, True),
        ("viscous_damper", {"damping": 0.1}, False),  # straight everywhere: that is what it is
        ("constant_force", {"force": 0.1}, False),
        ("sensor_drift", {"rate": 0.1}, False),
        ("coulomb_friction", {"force": 0.1, "transition": 0.01}, False),
        (
            "elastoplastic_hysteresis",
            {"stiffness": 1.0, "yield_displacement": 10.0},
            False,
        ),  # remembers: not judged
        ("clock_skew", {"skew": 1e-3}, False),  # no force at all
    ],
)
def test_what_bends_only_where_the_records_have_not_been_does_not_act_within_them(name, values, beyond):
    assert (shape(name, values)["acts_within_records"] < EDGE) is beyond


def test_records_without_a_command_have_a_reach_too():
    assert (
        shape("quadratic_drag", {"coefficient": 0.1}, motion(effort=0.0))["acts_within_records"] == math.inf
    )


def test_the_reach_of_a_leg_on_a_moving_base_is_the_distance_from_that_base():
    gap = {"gap": 0.1}
    assert shape("freeplay", gap)["acts_within_records"] == 0.0
    assert shape("freeplay", gap, motion(base=-0.15))["acts_within_records"] == math.inf


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


@pytest.mark.parametrize(
    ("frequency", "synchronous"), [(2.0, True), (4.09, True), (1.91, True), (2.11, False), (3.3, False)]
)
def test_a_disturbance_that_the_records_cannot_tell_from_the_forcing_in_frequency_keeps_step_with_it(
    frequency, synchronous
):
    values = {"amplitude": 0.1, "frequency": frequency}
    assert (shape("periodic_disturbance", values)["own_frequency"] < 1.0) is synchronous
    unforced = shape("periodic_disturbance", values, sizes=replace(SIZES, forcing_frequency=0.0))
    assert unforced["own_frequency"] == math.inf
    for damping, as_narrow_as_a_line in ((0.1, False), (0.001, True)):
        mode = shape("second_mode", {"mass": 0.1, "frequency": frequency, "damping_ratio": damping})
        assert (mode["own_frequency"] < 1.0) is (synchronous and as_narrow_as_a_line)


def test_of_several_effects_the_worst_statistics_are_told_and_labels_without_an_element_have_none():
    model = hopper().with_element(CATALOGUE["freeplay"], {"gap": 0.9})
    model = model.with_element(CATALOGUE["viscous_damper"], {"damping": 0.1})
    both = shape_of(model, ("freeplay", "viscous_damper"), motion(), SIZES)
    assert both["acts_within_records"] == 0.0
    assert shape_of(model, ("viscous_damper",), motion(), SIZES)["acts_within_records"] == math.inf
    assert shape_of(model, ("inertia.mass",), motion(), SIZES) == {}


@pytest.mark.parametrize(("frequency", "same"), [(2.5, True), (2.95, True), (3.5, False), (1.5, False)])
def test_a_resonance_between_the_frequencies_of_a_free_motions_swings_is_none_of_its_own(frequency, same):
    free = replace(SIZES, forcing_frequency=0.0, idle=True, frequency=2.4, swings=(2.0, 3.0), duration=10.0)
    values = {"mass": 0.01, "frequency": frequency, "damping_ratio": 0.001}
    assert (shape("second_mode", values, sizes=free)["own_frequency"] < 1.0) is same


@pytest.mark.parametrize(("apart", "same"), [(0.5, True), (-0.5, True), (3.0, False)])
def test_a_disturbance_at_the_frequency_of_a_free_motion_is_another_damping_or_stiffness(apart, same):
    free = replace(SIZES, forcing_frequency=0.0, idle=True)
    values = {"amplitude": 0.1, "frequency": free.frequency + apart / free.duration}
    assert (shape("periodic_disturbance", values, sizes=free)["own_frequency"] < 1.0) is same


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
