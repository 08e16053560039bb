"""Rows of a buffer that a recording did not fill are no part of it."""

import numpy as np
import pytest
from scipy.io import savemat

from rhythmid.record.table import Table
from rhythmid.start.start import start

TIME = 0.01 * np.arange(600)
SPEED = 20.0 * (1.0 - np.exp(-TIME / 0.3)) + 0.1 * np.sin(40.0 * TIME)


def buffer(path, rows, last=0.0):
    """A table of time, speed and duty whose last rows were never written; `last` is the duty of the last one."""
    duty = np.append(np.full(len(TIME), 0.4) + 0.1 * np.sin(2.0 * TIME), np.zeros(rows))
    duty[-1] = last if rows else duty[-1]
    savemat(
        path,
        {"time": np.append(TIME, np.zeros(rows)), "speed": np.append(SPEED, np.zeros(rows)), "duty": duty},
    )
    return path


@pytest.mark.parametrize("rows", [1, 400])
def test_rows_of_zeros_after_the_last_time_are_left_out_and_told(tmp_path, rows):
    begun = start([buffer(tmp_path / "run.mat", rows)])
    inventory = begun.guess.inventory
    assert inventory.clock.column == "time"
    assert {len(one.value) for one in inventory.recorded} == {len(TIME)}
    assert any("nothing but zeros after the last time" in note for note in inventory.notes)
    assert begun.guess.roles.output_kind == "velocity"


def test_rows_after_the_last_time_that_hold_a_number_are_kept(tmp_path):
    assert len(Table.load(buffer(tmp_path / "run.mat", 5, last=0.3)).column("time")) == len(TIME) + 5
    whole = Table.load(buffer(tmp_path / "whole.mat", 0))
    assert len(whole.column("time")) == len(TIME) and not whole.notes
