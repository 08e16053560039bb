"""Records of which the effort was measured, and no input: what drives the model in `identify`, and what is said of it."""

from dataclasses import replace

import numpy as np
import pytest

from rhythmid.diagnose.admission import check_driven
from rhythmid.errors import InputError
from rhythmid.identify.identify import identify
from rhythmid.model import Model
from rhythmid.record.record import Channel, Record
from rhythmid.simulation.signal import zero_order_hold
from rhythmid.simulation.simulate import simulate

SLIDE = """
inertia: {{mass: {{value: {mass}, unit: kg}}}}
{controller}
force:
  - viscous_damper: {{damping: {{value: 3.0, unit: N*s/m}}}}
  - linear_spring: {{stiffness: {{value: 60.0, unit: N/m}}, rest_length: {{value: 0.0, unit: m, fixed: true}}}}
"""
CONTROLLER = "command: [position_control: {proportional: {value: 50.0}, derivative: {value: 3.0}}]"


def slide(mass: float, controller: str = "") -> Model:
    return Model.from_text(SLIDE.format(mass=mass, controller=controller))


def measured(seed: int) -> Record:
    """10 s of a slide of 2 kg, with the motor's effort beside its motion."""
    rng = np.random.default_rng(seed)
    time = np.arange(0.0, 10.0, 0.01)
    lines = np.linspace(0.3, 2.0, 8)
    waves = np.sin(2.0 * np.pi * lines[:, None] * time + rng.uniform(0.0, 6.0, 8)[:, None])
    effort = waves.sum(axis=0)
    moved = simulate(slide(2.0), time, zero_order_hold(time, effort), None, (0.0, 0.0)).output
    moved = moved + 1e-3 * np.std(moved) * rng.standard_normal(len(time))
    force = Channel(time, effort, "N", source="force")
    return Record(f"slide {seed}", Channel(time, moved, "m"), effort=force, hold="zero")


def test_a_machine_of_which_only_the_effort_was_recorded_is_driven_by_it():
    found = identify(measured(2), slide(1.0), holdout=measured(3))
    assert found.usable and found.parameters["inertia.mass"].value == pytest.approx(2.0, rel=0.01)
    assert found.notes == ("The simulation is driven by the recorded effort (force).",)
    assert found.held_out is not None and found.held_out.nrmse == pytest.approx(0.0, abs=0.01)


def test_a_machine_whose_effort_was_recorded_is_no_free_motion():
    record = measured(2)
    assert check_driven([record], slide(1.0)) is None
    said = check_driven([replace(record, effort=None)], slide(1.0))
    assert said is not None and "taken for a free motion" in said


def test_a_controller_is_driven_by_the_reference_and_not_by_the_effort_it_makes():
    record = measured(2)
    with pytest.raises(InputError, match="the model has a controller, but no reference is recorded"):
        identify(record, slide(2.0, CONTROLLER))
    led = replace(record, reference=record.output)
    found = identify(led, slide(2.0, CONTROLLER))
    assert any("closed loop from the recorded reference" in note for note in found.notes)
    assert "no recorded input changes" not in found.delays.assumption


AXIS = "inertia: {{mass: {{value: {mass}, unit: kg}}}}\nforce: [viscous_damper: {{damping: {{value: {damping}, unit: N*s/m}}}}]"


def pushed(seed: int = 4) -> Record:
    """60 s of an axis of 2 kg that nothing holds, which small pushes that were not recorded carry far from where its effort would."""
    rng = np.random.default_rng(seed)
    time = np.arange(0.0, 60.0, 0.01)
    lines = np.linspace(0.3, 2.0, 8)
    effort = np.sin(2.0 * np.pi * lines[:, None] * time + rng.uniform(0.0, 6.0, 8)[:, None]).sum(axis=0)
    pushes = 0.2 * np.repeat(rng.standard_normal(30), 200)
    truth = Model.from_text(AXIS.format(mass=2.0, damping=0.1))
    moved = simulate(truth, time, zero_order_hold(time, effort + pushes), None, (0.0, 0.0)).output
    return Record("axis", Channel(time, moved, "m"), effort=Channel(time, effort, "N"), hold="zero")


def test_where_a_free_run_does_not_follow_the_values_by_the_balance_of_the_effort_are_told():
    found = identify(pushed(), Model.from_text(AXIS.format(mass=1.5, damping=0.1)))
    assert not found.usable
    (said,) = [note for note in found.notes if "the balance of the recorded effort" in note]
    told = float(said.partition("inertia.mass ")[2].partition(" ")[0])
    assert told == pytest.approx(2.0, rel=0.02) and "`rhythmid diagnose`" in said


def test_of_a_free_run_that_follows_nothing_is_said_of_the_balance():
    assert not any("balance" in note for note in identify(measured(2), slide(1.0)).notes)
