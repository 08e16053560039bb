"""What an identification saves can be read again: bounds that a fit extends end at those of the file."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as some

from rhythmid.identify.admissible import admissible
from rhythmid.identify.identify import identify
from rhythmid.identify.joint import prepared_model
from rhythmid.model import Model
from rhythmid.record.record import Channel, Record
from rhythmid.simulation.signal import zero_order_hold
from rhythmid.simulation.simulate import simulate

AXIS = Model.from_text(
    "inertia: {mass: {value: 2.0, unit: kg}}\nforce: [viscous_damper: {damping: {value: 3.0, unit: N*s/m}}]"
)
OWN = Model.from_text(
    """
inertia: {mass: {value: 2.0, unit: kg}}
command: [input_delay: {delay: {value: 0.004, bounds: [0.0, 0.02], prior: {mean: 0.004, std: 0.001}}}]
force: [viscous_damper: {damping: {value: 3.0, unit: N*s/m, bounds: [1.0, 5.0]}}]
sensor: [measurement_delay: {delay: {value: 0.0}}]
"""
)
PERIOD = 0.01


def record(early: float = 0.0) -> Record:
    """10 s of the axis, whose input is stamped `early` [s] after it acts."""
    time = np.arange(1000) * PERIOD
    force = np.sin(2.0 * time) + np.sin(7.3 * time)
    moved = simulate(AXIS, time, zero_order_hold(time - early, force), None, (0.0, 0.0)).output
    moved = moved + 1e-4 * np.random.default_rng(5).standard_normal(len(time))
    return Record("axis", Channel(time, moved, "m"), Channel(time, force, "N"), hold="zero")


@cache
def ready_of(which: str) -> Model:
    """A model as a fit of the record begins with it."""
    return prepared_model({"axis": AXIS, "own": OWN}[which], [record()])[0]


@settings(max_examples=40, deadline=None)
@given(some.sampled_from(["axis", "own"]), some.data())
def test_whatever_a_fit_finds_within_its_extended_bounds_can_be_read_again(which, data):
    nominal, ready = {"axis": AXIS, "own": OWN}[which], ready_of(which)
    values = {
        name: data.draw(some.floats(max(low, -1e3), min(high, 1e3)), label=name)
        for name in ready.free
        for low, high in [ready.parameters[name].bounds]
        if name != "inertia.mass"
    }
    kept = admissible(ready.with_values(values), nominal)
    again = Model.from_text(kept.model.to_yaml())
    for name, value in again.parameters.items():
        assert value.value == kept.model.value(name)
        if name in nominal.parameters:
            assert (value.bounds, value.prior) == (
                nominal.parameters[name].bounds,
                nominal.parameters[name].prior,
            )
    assert set(kept.moved) == {n for n, v in values.items() if v != kept.model.value(n)}


def test_a_delay_that_comes_out_negative_is_saved_as_zero_with_a_note():
    found = identify(record(early=0.4 * PERIOD), AXIS)
    assert found.delays.sum.value == pytest.approx(-0.4 * PERIOD, rel=0.1)
    saved = Model.from_text(found.model.to_yaml())
    assert saved.value("input_delay.delay") == 0.0
    (note,) = [one for one in found.notes if "saved as" in one]
    assert (
        note.startswith("input_delay.delay comes out at -")
        and "saved as 0 ms, for a machine does not respond before" in note
    )


def test_a_delay_that_scatters_about_zero_is_told_only_where_the_model_has_one():
    early = OWN.with_parameters(
        {"input_delay.delay": replace(OWN.parameters["input_delay.delay"], value=-1e-5)}
    )
    std = {"input_delay.delay": 1e-4}
    assert (
        admissible(early, AXIS, std).notes == ()
        and admissible(early, AXIS, std).model.value("input_delay.delay") == 0.0
    )
    assert len(admissible(early, OWN, std).notes) == 1
    assert len(admissible(early, AXIS, {"input_delay.delay": 1e-6}).notes) == 1


def test_a_value_inside_its_bounds_is_saved_as_it_is():
    model = OWN.with_values({"input_delay.delay": 0.01})
    kept = admissible(replace(model), OWN)
    assert kept.model == model and kept.notes == ()
