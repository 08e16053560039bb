"""What the paper's method refuses in one line, and joint maximum likelihood identifies without transfer functions."""

import pytest
import twins

from rhythmid.errors import InputError
from rhythmid.identify.identify import identify
from rhythmid.model import Model


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
    assert found.delays.assumption == "nothing that is recorded drives the machine, so no delay shows"
