"""Rows of a table without a time."""

import numpy as np
import pytest

from rhythmid.errors import InputError
from rhythmid.record.inventory import inventory
from rhythmid.record.table import Table


def written(folder, missing):
    """A table of 300 rows, of which those in `missing` have no time."""
    table = folder / "run.csv"
    rows = [f"{'' if k in missing else 0.01 * k:},{np.sin(0.1 * k):.6f}" for k in range(300)]
    table.write_text("timestamp,angle\n" + "\n".join(rows) + "\n", encoding="utf-8")
    return table


@pytest.mark.parametrize("missing", [{0}, {17, 250}])
def test_a_few_rows_without_a_time_are_left_out_and_told(tmp_path, missing):
    found = Table.load(written(tmp_path, missing))
    assert len(found.column("angle")) == 300 - len(missing)
    assert any(f"row {min(missing) + 1}" in note for note in inventory(found.path).notes)


def test_many_rows_without_a_time_are_refused(tmp_path):
    with pytest.raises(InputError, match="time is missing in row"):
        inventory(written(tmp_path, set(range(20, 40))))
