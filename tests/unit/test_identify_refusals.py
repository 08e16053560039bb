"""What `identify` refuses in one line: machines that it cannot speak of, and records without an excitation."""

import pytest
import twins

from rhythmid.errors import InputError
from rhythmid.identify.identify import identify
from rhythmid.model import Model


def test_a_machine_that_does_not_return_to_its_cycle_has_no_transfer_functions():
    twin = twins.axis(friction=0.0, count=1, duration=6.0)
    with pytest.raises(InputError, match="does not return to its cycle"):
        identify(twin.records[0], Model.from_text(twin.nominal))


def test_a_record_without_an_excitation_is_refused_and_the_way_out_is_named():
    twin = twins.decay(count=1)
    with pytest.raises(InputError, match="no input channel.*rhythmid diagnose"):
        identify(twin.records[0], Model.from_text(twin.nominal))
