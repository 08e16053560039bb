"""A record is cut to a part that is stated in order, and its text is one line."""

import numpy as np
import pytest

from rhythmid.errors import InputError
from rhythmid.record.record import Channel, Record

TIME = np.arange(1000) / 100.0
RECORD = Record("swing", Channel(TIME, np.sin(TIME), "m"), Channel(TIME, np.cos(TIME), "N"))


@pytest.mark.parametrize("use", [(5.0, 3.0), (5.0, 5.0)])
def test_a_part_that_ends_before_it_begins_is_refused_as_that(use):
    with pytest.raises(InputError, match=r"swing: use: \[5, [35]\] s: the start is not before the end"):
        RECORD.cut(*use)


def test_the_text_of_a_record_is_one_short_line():
    assert repr(RECORD) == str(RECORD) == "<Record swing: 9.99 s of position at 100 Hz; input, output>"
