"""What the paper's method refuses in one line, and joint maximum likelihood identifies without transfer functions."""

import numpy as np
import pytest
import twins

from rhythmid.errors import InputError
from rhythmid.identify.identify import identify
from rhythmid.model import Model
from rhythmid.record.record import Channel, Record


def test_a_machine_that_does_not_return_to_its_cycle_has_no_transfer_functions():
    twin = twins.axis(friction=0.0, count=1, duration=6.0)
    model = Model.from_text(twin.nominal)
    with pytest.raises(InputError, match="does not return to its cycle"):
        identify(twin.records[0], model, method="paper")
    found = identify(twin.records[0], model)
    assert found.usable and found.shown.functions is None and found.shown.missing
    assert found.parameters["inertia.mass"].value == pytest.approx(2.0, rel=0.02)


def test_a_free_decay_is_an_ordinary_record_that_shows_no_delay():
    twin = twins.decay(count=1)
    model = Model.from_text(twin.nominal)
    with pytest.raises(InputError, match="no input channel.*rhythmid diagnose"):
        identify(twin.records[0], model, method="paper")
    found = identify(twin.records[0], model)
    assert found.delays.sum.value is None
    assert found.delays.assumption == "no recorded input changes, so no delay shows"


def test_a_step_that_was_made_as_the_record_began_has_no_transfer_functions():
    rng = np.random.default_rng(1)
    time = np.arange(0.0, 3.0, 0.01)
    speed = 0.6 * (1.0 - np.exp(-time / 0.3)) + 1e-3 * rng.standard_normal(len(time))
    step, moved = Channel(time, np.full(len(time), 10.0), "N"), Channel(time, speed, "m/s")
    record = Record("step", moved, step, hold="zero", output_kind="velocity")
    model = Model.from_text("inertia: {mass: {value: 1.0}}\nforce: [viscous_damper: {damping: {value: 1.0}}]")
    with pytest.raises(InputError, match="its input never changes"):
        identify(record, model, method="paper")
    found = identify(record, model)
    assert found.usable and found.parameters["inertia.mass"].value == pytest.approx(5.0, rel=0.02)
