"""Text tables whose first rows have empty cells, or words for a number that is missing, as where channels start one after the other."""

import re

import numpy as np
import pytest

from rhythmid.errors import InputError
from rhythmid.record.inventory import inventory
from rhythmid.record.read import read_record
from rhythmid.record.signals import Signals
from rhythmid.record.text_table import read_text

COUNT = 400
TIME = 0.005 * np.arange(COUNT)
COLUMNS = np.column_stack([TIME, np.sin(7.0 * TIME), np.cos(5.0 * TIME), 2.0 + np.cos(3.0 * TIME)])
NAMES = ("time", "axis0.encoder.pos_estimate", "axis0.encoder.vel_estimate", "axis0.motor.Iq_measured")


def written(path, rows: int, word: str, separator: str = ",", names: bool = True, last: str | None = None):
    """A table whose first `rows` have a `word` in place of all but the time; with a column of words where `last` is one."""
    lines = [separator.join(NAMES if last is None else (*NAMES, "state"))] if names else []
    for number, row in enumerate(COLUMNS):
        cells = [f"{value:.6f}" for value in row]
        if number < rows:
            cells[1:] = [word] * 3
        lines.append(separator.join(cells if last is None else [*cells, "" if number < rows else last]))
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path


@pytest.mark.parametrize(("rows", "names"), [(1, True), (3, True), (250, True), (1, False), (3, False)])
@pytest.mark.parametrize(
    ("separator", "word"),
    [(",", ""), (",", "nan"), (",", "undefined"), (",", '""'), (";", ""), ("\t", "NaN"), (" ", "nan")],
)
def test_what_is_missing_in_the_first_rows_is_a_missing_number(tmp_path, separator, word, rows, names):
    found = read_text(written(tmp_path / "run.csv", rows, word, separator, names))
    assert list(found) == (list(NAMES) if names else list("0123"))
    told = np.column_stack(list(found.values()))
    assert np.isnan(told[:rows, 1:]).all()
    np.testing.assert_allclose(told[rows:], COLUMNS[rows:], atol=1e-6)
    np.testing.assert_allclose(told[:, 0], TIME, atol=1e-9)


def test_a_column_of_words_may_begin_empty(tmp_path):
    found = read_text(written(tmp_path / "run.csv", 3, "", last="RUN"))
    assert list(found["state"][:5]) == ["", "", "", "RUN", "RUN"]
    assert np.isnan(found[NAMES[1]][:3]).all() and found[NAMES[1]].dtype == np.float64


def test_missing_cells_are_missing_measurements(tmp_path):
    path = written(tmp_path / "run.csv", 3, "")
    signals = Signals.from_text(
        f"time: {{column: time}}\noutput: {{column: {NAMES[1]}, unit: rad}}\ninput: {{column: {NAMES[3]}, unit: N*m}}\n"
    )
    record = read_record(path, signals)
    assert len(record.output) == COUNT - 3 and record.quality.channels["output"].nan == 3


def test_times_that_are_missing_in_more_than_a_few_rows_are_refused_with_the_row(tmp_path):
    path = written(tmp_path / "run.csv", 1, "")
    path.write_text(re.sub(r"\n0\.0[0-9]0000,", "\n,", path.read_text()))
    with pytest.raises(InputError, match="time is missing in row 2"):
        inventory(path)
