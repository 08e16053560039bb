"""Step tests as a small computer logs them: tables without names, times of an uneven loop, one level of the drive in each."""

import re
from pathlib import Path

import numpy as np
import pytest

from rhythmid.errors import InputError
from rhythmid.start.start import guess, start

MASS, DAMPING = 0.02, 0.15
LATE = (0.0055, 0.0062, 0.0058, 0.04, 0.006, 0.0065)  # [s] a loop that waits at times


def stepped(folder: Path, duty: float, name: str = "") -> Path:
    """A record of duty, time, speed and angle, from the step on."""
    time = np.cumsum(np.resize(LATE, 120))
    speed = duty / DAMPING * (1.0 - np.exp(-time * DAMPING / MASS))
    angle = np.round(duty / DAMPING * time - MASS / DAMPING * speed)
    path = folder / f"{name or f'step{duty:g}'}.csv"
    table = np.column_stack([np.full(len(time), duty), time, np.round(speed), angle])  # whole degrees
    np.savetxt(path, table, delimiter="; ")
    return path


def test_the_only_column_that_increases_in_every_row_is_the_time(tmp_path):
    found = guess(stepped(tmp_path, 60.0))
    assert found.clock.column == "1" and found.clock.scale == 1.0
    assert "the only column that increases in every row" in found.signals


def test_of_two_columns_that_increase_in_every_row_none_is_the_time(tmp_path):
    time = np.cumsum(np.resize(LATE, 120))
    np.savetxt(tmp_path / "run.csv", np.column_stack([time**2, time, np.sin(9.0 * time)]), delimiter=",")
    with pytest.raises(InputError, match="no column goes forward like a time"):
        guess(tmp_path / "run.csv")


def test_what_is_constant_in_each_recording_and_steps_from_one_to_the_next_drives(tmp_path):
    sources = [stepped(tmp_path, duty) for duty in (60.0, -40.0, 100.0)]
    begun = start(sources)
    choice = begun.guess.roles.choices["input"]
    assert str(choice.recorded) == "0" and choice.reason.startswith(
        "it has another level in other recordings"
    )
    assert begun.nominal.model.value("viscous_damper.damping") == pytest.approx(DAMPING, rel=0.1)


def test_what_is_the_same_in_all_recordings_drives_nothing(tmp_path):
    sources = [stepped(tmp_path, 60.0, name) for name in ("first", "second")]
    assert "input" not in start(sources).guess.roles.choices


@pytest.mark.parametrize("offset", [13.0, 1.7e9])
def test_the_part_that_may_be_used_is_told_on_the_clock_of_the_record(tmp_path, offset):
    table = np.loadtxt(stepped(tmp_path, 60.0), delimiter=";")
    table[:, 1] += offset
    np.savetxt(tmp_path / "late.csv", table, delimiter="; ", fmt="%.6f")
    told = re.search(r"# use: \[(.*), (.*)\]", guess(tmp_path / "late.csv").signals)
    assert told and [float(t) for t in told.groups()] == pytest.approx(table[[0, -1], 1], abs=2e-3, rel=0)
