"""A linear restoring force is a hypothesis wherever the nominal model has none, although no score shows it there."""

from dataclasses import replace

import numpy as np
import pytest

from machines import CATALOGUE
from rhythmid.diagnose.search.proposals import is_restored, restoring_force
from rhythmid.elements.candidates import DYING, NEVER_REVERSED, ONE_WAY, candidates
from rhythmid.identify.descent import WHITE
from rhythmid.identify.output_error import start_only
from rhythmid.identify.record_scales import scales
from rhythmid.identify.series import Series
from rhythmid.model import Model
from rhythmid.record.back_and_forth import goes_back_and_forth
from rhythmid.simulation.signal import first_order_hold

FREE = """
inertia: {mass: {value: 1.0, unit: kg}}
force: [{viscous_damper: {damping: {value: 1.0, unit: N*s/m}}}]
"""
TIME = 5e-3 * np.arange(2000)


def turning(speed: np.ndarray) -> Series:
    """A record of the speed of a machine that is pushed to and fro."""
    push = first_order_hold(TIME, np.sin(6.0 * TIME))
    return Series("made", TIME, speed, push, None, 1, np.ones(len(TIME), bool), 5e-3, measured="velocity")


def proposed(model: Model, series: Series) -> list[tuple[str, ...]]:
    """What is proposed beside a fit that has the labels of no effect."""
    return [one.added for one in restoring_force(start_only(model, [series], WHITE, 5e-3), CATALOGUE, ())]


def free() -> Model:
    return Model.from_text(FREE, catalogue=CATALOGUE)


def test_a_spring_is_proposed_where_nothing_restores_a_motion_that_comes_back():
    assert proposed(free(), turning(np.sin(6.0 * TIME))) == [("linear_spring",)]


def test_no_spring_is_proposed_where_the_motion_does_not_come_back():
    assert proposed(free(), turning(np.exp(-TIME))) == []


def test_a_motion_that_never_comes_back_shows_no_stiffness():
    """Its position stands for its speed and for the time."""
    for speed, shown in ((np.exp(-TIME), False), (np.sin(6.0 * TIME), True)):
        sizes = scales([turning(speed)], free())
        found = candidates(CATALOGUE, free().setting, sizes)
        assert sizes.comes_back is shown
        for name in ("cubic_stiffness", "position_dependent_damping"):
            assert (found.not_tried.get(name) == ONE_WAY) is not shown
    held = free().with_element(CATALOGUE["linear_spring"], {"stiffness": 5.0})
    never = scales([turning(np.exp(-TIME))], held)
    assert "cubic_stiffness" not in candidates(CATALOGUE, held.setting, never).not_tried


@pytest.mark.parametrize(("element", "values"), [
    ("pendulum_gravity", {"moment": 5.0, "reference": 0.0}), ("cubic_stiffness", {"coefficient": 5.0}),
])  # fmt: skip
def test_no_spring_is_proposed_where_a_force_depends_on_the_position(element, values):
    held = free().with_element(CATALOGUE[element], values)
    series = turning(np.sin(6.0 * TIME))
    assert is_restored(start_only(held, [series], WHITE, 5e-3)) and proposed(held, series) == []


def test_a_motion_that_never_comes_back_shows_no_way_before_sliding():
    """Without reversals hysteresis is a spring from wherever the record begins."""
    hysteresis = ("elastoplastic_hysteresis", "bouc_wen_hysteresis")
    for speed, shown in ((np.exp(-TIME), False), (np.sin(6.0 * TIME), True)):
        found = candidates(CATALOGUE, free().setting, scales([turning(speed)], free()))
        assert all((found.not_tried.get(name) == NEVER_REVERSED) is not shown for name in hysteresis)
        assert any(element.name == "coulomb_friction" for element, _ in found.tried)


def test_a_motion_that_meets_each_speed_once_shows_laws_of_its_speed_alone():
    """What goes with the time or the past goes with the speed as well; not so where a loose part makes it swing."""
    untold = ("second_mode", "viscoelastic_relaxation", "sensor_drift")
    swinging = np.exp(-TIME) * (1.0 + 0.6 * np.sin(6.0 * TIME))
    for speed, told in ((np.exp(-TIME), False), (swinging, True), (np.sin(6.0 * TIME), True)):
        coasting = replace(turning(speed), command=None)
        found = candidates(CATALOGUE, free().setting, scales([coasting], free()))
        assert all((found.not_tried.get(name) == DYING) is not told for name in untold)
        assert {"quadratic_drag", "coulomb_friction"} <= {element.name for element, _ in found.tried}


@pytest.mark.parametrize(
    ("turns", "shown"),
    [((0.0, 1.0, -1.0, -0.1), True), ((0.0, 1.0, 0.4), True), ((0.0, 1.0, 0.6), False), ((-1.0, 1.0), False)],
    ids=["a cycle that is not closed", "more than half of the way back", "less than that", "one way"],
)
def test_a_motion_comes_back_when_it_passes_half_of_its_travel_both_ways(turns, shown):
    """Wherever in its cycle the record begins."""
    place = np.interp(TIME, np.linspace(TIME[0], TIME[-1], len(turns)), turns)
    assert goes_back_and_forth([place]) is shown
