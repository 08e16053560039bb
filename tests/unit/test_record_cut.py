"""A record is cut to a part that is stated in order, and its text is one line."""

import numpy as np
import pytest

from rhythmid.errors import InputError
from rhythmid.record.load import load
from rhythmid.record.record import Channel, Record

TIME = np.arange(1000) / 100.0
RECORD = Record("swing", Channel(TIME, np.sin(TIME), "m"), Channel(TIME, np.cos(TIME), "N"))


@pytest.mark.parametrize("use", [(5.0, 3.0), (5.0, 5.0)])
def test_a_part_that_ends_before_it_begins_is_refused_as_that(use):
    with pytest.raises(InputError, match=r"swing: use: \[5, [35]\] s: the start is not before the end"):
        RECORD.cut(*use)


def test_the_text_of_a_record_is_one_short_line():
    assert repr(RECORD) == str(RECORD) == "<Record swing: 9.99 s of position at 100 Hz; input, output>"


def test_each_of_several_records_has_a_part_of_its_own(tmp_path):
    for name in ("one", "2"):
        np.savetxt(
            tmp_path / f"{name}.csv",
            np.column_stack([TIME, np.sin(TIME)]),
            delimiter=",",
            header="t,x",
            comments="",
        )
    signals = {"time": {"column": "t"}, "output": {"column": "x"}, "use": {"one": [1, 8], 2: [3, 5]}}
    assert load(tmp_path / "one.csv", signals).duration == pytest.approx(6.99)
    assert load(tmp_path / "2.csv", signals).duration == pytest.approx(1.99)


@pytest.mark.parametrize(
    ("use", "said"),
    [
        ({"two": [1, 8]}, "use: has no part of the record 'one', only of two"),
        ({"one": [8, 1]}, r"use\.one: .*no range"),
        ({"one": [1, 8, 9]}, r"use\.one: two numbers"),
        ({"one": None}, r"use\.one: "),
    ],
)
def test_a_part_by_record_that_is_missing_or_wrong_is_refused(tmp_path, use, said):
    np.savetxt(
        tmp_path / "one.csv", np.column_stack([TIME, np.sin(TIME)]), delimiter=",", header="t,x", comments=""
    )
    with pytest.raises(InputError, match=said):
        load(tmp_path / "one.csv", {"time": {"column": "t"}, "output": {"column": "x"}, "use": use})
