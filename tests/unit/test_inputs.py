"""What drives a series, as the compiled loop takes it."""

import numpy as np
import pytest

from rhythmid.identify.inputs import LONG, Inputs
from rhythmid.simulation.signal import pieces, zero_order_hold


@pytest.mark.parametrize("count", [100, LONG])
def test_pieces_of_a_command_are_the_same_whether_they_are_kept_or_those_of_a_long_record(count):
    held = zero_order_hold(1e-3 * np.arange(count), np.sin(np.arange(count)))
    given = Inputs(held, None)
    for found, made in zip(given.command, pieces(held), strict=True):
        assert np.array_equal(found, made)
    assert (given.command[0] is given.command[0]) == (count < LONG)
