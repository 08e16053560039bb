"""Stand-ins: effects that bend beyond the records, end at the edge of what they may be, or keep step with the forcing."""

from dataclasses import replace
from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest

from machines import CATALOGUE, hopper
from rhythmid.diagnose.search.score_tests import Trajectories
from rhythmid.diagnose.stand_ins import stand_ins
from rhythmid.elements.element import Scales
from rhythmid.simulation.effect import Path

SIZES = Scales(
    position=0.02, velocity=0.1, effort=4.0, centre=0.1, low=0.07, high=0.13, mass=1.0, stiffness=200.0,
    frequency=2.0, duration=10.0, period=1e-2, forcing_frequency=2.0,
)  # fmt: skip
TIME = 0.01 * np.arange(1000)
PHASE = 2.0 * np.pi * TIME


def motion(name: str, values: dict[str, float], base: float = 0.0) -> Trajectories:
    """The hopper with one more element, seen between 0.07 and 0.13 m and pushed by up to 6 N; `base` moves its ground."""
    path = Path(
        TIME, 0.10 + 0.03 * np.sin(PHASE), 0.2 * np.cos(PHASE), 6.0 * np.cos(1.3 * PHASE), np.sin(PHASE),
        0.10 + 0.03 * np.sin(PHASE),
    )  # fmt: skip
    leg = Path(path.time, path.position - base, path.velocity, path.effort, path.leg, path.signal)
    fit = SimpleNamespace(model=hopper().with_element(CATALOGUE[name], values))
    known = SimpleNamespace(fit=fit, paths=(path,), legs=(leg,), commands=(path.effort,))
    return cast(Trajectories, known)


def replace_fit(known: Trajectories, fit: SimpleNamespace) -> Trajectories:
    return cast(
        Trajectories, SimpleNamespace(fit=fit, paths=known.paths, legs=known.legs, commands=known.commands)
    )


def replace_paths(known: Trajectories, path: Path) -> Trajectories:
    return cast(
        Trajectories, SimpleNamespace(fit=known.fit, paths=(path,), legs=(path,), commands=(path.effort,))
    )


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
def test_what_bends_only_where_the_records_have_not_been_is_beyond_their_reach(name, values, beyond):
    said = stand_ins(motion(name, values), (name,), SIZES)
    assert [name.replace("_", " ") in one and "beyond the records' range" in one for one in said] == (
        [True] if beyond else []
    )


def test_records_without_a_command_have_a_reach_too():
    known = motion("quadratic_drag", {"coefficient": 0.1})
    still = replace(known.paths[0], effort=np.zeros(len(TIME)))
    assert not stand_ins(replace_paths(known, still), ("quadratic_drag",), SIZES)


def test_the_reach_of_a_leg_on_a_moving_base_is_the_distance_from_that_base():
    gap = {"gap": 0.1}
    assert stand_ins(motion("freeplay", gap), ("freeplay",), SIZES)
    assert not stand_ins(motion("freeplay", gap, base=-0.15), ("freeplay",), SIZES)


@pytest.mark.parametrize(("share", "edge"), [(0.75, True), (0.7499, True), (0.74, False), (0.2, False)])
def test_a_ripple_as_long_as_it_may_be_is_a_spring(share, edge):
    ripple = CATALOGUE["position_ripple"].within(SIZES)
    values = {"amplitude": 0.1, "wavelength": share * 0.06}
    fit = SimpleNamespace(model=hopper().with_element(ripple, values))
    known = replace_fit(motion("viscous_damper", {"damping": 0.1}), fit)
    said = stand_ins(known, ("position_ripple",), SIZES)
    assert ["the edge of what it can be (wavelength)" in one for one in said] == ([True] if edge else [])


@pytest.mark.parametrize(
    ("share", "damping", "edge"),
    [(1.0, 0.1, "frequency"), (0.5, 1.0, "damping_ratio"), (0.5, 0.1, None), (0.5, 0.0, None)],
)
def test_a_mode_as_fast_as_the_samples_or_overdamped_is_something_else(share, damping, edge):
    mode = CATALOGUE["second_mode"].within(SIZES)
    values = {"mass": 0.01, "frequency": share * 0.5 / SIZES.period, "damping_ratio": damping}
    fit = SimpleNamespace(model=hopper().with_element(mode, values))
    known = replace_fit(motion("viscous_damper", {"damping": 0.1}), fit)
    said = stand_ins(known, ("second_mode",), SIZES)
    assert [f"the edge of what it can be ({edge})" in one for one in said] == ([True] if edge else [])


@pytest.mark.parametrize(
    "name", ["coulomb_friction", "asymmetric_coulomb_friction", "load_dependent_friction"]
)
@pytest.mark.parametrize(("times", "damper"), [(2.0, True), (1.9, False), (0.01, False)])
def test_dry_friction_that_turns_over_all_speeds_is_a_damper(name, times, damper):
    friction = CATALOGUE[name].within(SIZES)
    values = {one.name: 0.1 for one in friction.parameters} | {"transition": times * SIZES.velocity}
    fit = SimpleNamespace(model=hopper().with_element(friction, values))
    said = stand_ins(replace_fit(motion("viscous_damper", {"damping": 0.1}), fit), (name,), SIZES)
    assert ["the edge of what it can be (transition)" in one for one in said] == ([True] if damper else [])


@pytest.mark.parametrize(
    ("frequency", "synchronous"), [(2.0, True), (4.09, True), (1.91, True), (2.11, False), (3.3, False)]
)
def test_a_disturbance_that_the_records_cannot_tell_from_the_forcing_in_frequency_is_a_stand_in(
    frequency, synchronous
):
    known = motion("periodic_disturbance", {"amplitude": 0.1, "frequency": frequency})
    said = stand_ins(known, ("periodic_disturbance",), SIZES)
    assert ["the forcing's own frequency" in one for one in said] == ([True] if synchronous else [])
    assert not stand_ins(known, ("periodic_disturbance",), replace(SIZES, forcing_frequency=0.0))
    for damping, as_narrow_as_a_line in ((0.1, False), (0.001, True)):
        mode = motion("second_mode", {"mass": 0.1, "frequency": frequency, "damping_ratio": damping})
        assert bool(stand_ins(mode, ("second_mode",), SIZES)) is (synchronous and as_narrow_as_a_line)
