"""MATLAB's `timeseries` in MAT files of version 5, written byte by byte as MATLAB writes them."""

import numpy as np
import pytest
from matlab_objects import EVEN, LISTED, timeseries_file

from rhythmid.errors import InputError
from rhythmid.record.table import Table

COUNT = 50
SPEED = np.linspace(0.0, 3.0, COUNT)[:, None]


def write(path, version, time, values):
    path.write_bytes(timeseries_file(SPEED, time, values, version))
    return path


@pytest.mark.parametrize(
    ("time", "values", "expected"),
    [
        (EVEN, (float(COUNT), 2.0, 0.1), 2.0 + 0.1 * np.arange(COUNT)),
        (LISTED, (np.arange(COUNT)[:, None] ** 1.5,), np.arange(COUNT) ** 1.5),
    ],
    ids=["even", "listed"],
)
def test_a_timeseries_is_read_with_its_times_and_its_name(tmp_path, time, values, expected):
    table = Table.load(write(tmp_path / "run.mat", 4, time, values))
    np.testing.assert_allclose(table.column("run.Time"), expected)
    np.testing.assert_allclose(table.column("run.Motor speed"), SPEED[:, 0])


@pytest.mark.parametrize(
    ("version", "length"), [(9, float(COUNT)), (4, 1e15)], ids=["unknown layout", "more times than values"]
)
def test_a_timeseries_that_cannot_be_read_is_refused_with_the_command_that_writes_it(
    tmp_path, version, length
):
    path = write(tmp_path / "run.mat", version, EVEN, (length, 0.0, 0.1))
    with pytest.raises(InputError, match=r"timeseries2timetable\(run\)"):
        Table.load(path)
