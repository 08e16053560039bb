"""Where the time of a record begins."""

from pathlib import Path

import numpy as np
import pytest

from rhythmid.record.load import load
from rhythmid.record.record import Record
from rhythmid.record.time_origin import origin_of
from rhythmid.start.start import start

SIGNALS = """
time: {column: t}
input: {column: u, unit: N}
output: {column: x, unit: m}
"""


def table(folder: Path, first: float, more: str = "") -> Record:
    """A record of 20 s whose clock reads `first` at its first row."""
    time = np.arange(0.0, 20.0, 0.01)
    np.savez(folder / "run.npz", t=first + time, u=np.cos(time), x=np.sin(time))
    signals = folder / "signals.yaml"
    signals.write_text(SIGNALS + more, encoding="utf-8")
    return load(folder / "run.npz", signals)


def test_a_clock_that_started_with_the_run_is_kept_and_another_counted_from_the_first_sample():
    assert [origin_of(first) for first in (0.0, 9.9, 10.0, -3.0, 4673.0)] == [0.0, 0.0, 10.0, -3.0, 4673.0]


@pytest.mark.parametrize("first", [4673.7, 1.7e9])
def test_times_of_a_table_begin_with_it_and_so_do_those_of_all_its_channels(tmp_path, first):
    record = table(tmp_path, first)
    for channel in record.channels.values():
        assert channel.time[0] == pytest.approx(0.0, abs=1e-6)
        assert channel.time[-1] == pytest.approx(19.99, abs=1e-5)


def test_what_is_used_is_told_in_the_time_of_the_table_and_keeps_its_place_in_the_run(tmp_path):
    record = table(tmp_path, 4673.0, "use: [4678, 4688]\n")
    assert (record.output.time[0], record.output.time[-1]) == pytest.approx((5.0, 15.0), abs=0.02)


def test_the_phase_of_a_forcing_that_is_given_by_formula_stays_in_the_time_of_the_table(tmp_path):
    record = table(tmp_path, 50.0, "forcing: {amplitude: 1.0, frequency: 1.0, phase: 0.0}\n")
    assert record.forcing is not None and record.output.time[0] == pytest.approx(50.0)


@pytest.mark.parametrize("first", [3.0, 5091.0, 1.7e9])
def test_the_part_to_use_that_init_writes_is_on_the_clock_of_the_table(tmp_path, first):
    time = np.arange(0.0, 8.0, 0.005)
    moving = np.clip(time - 1.5, 0.0, None)  # held for 1.5 s, then released
    angle = 1.2 * np.where(moving > 0.0, np.exp(-0.2 * moving) * np.cos(6.0 * moving), 1.0)
    np.savetxt(
        tmp_path / "drop.csv",
        np.column_stack([first + time, angle]),
        delimiter=",",
        header="t,angle [rad]",
        comments="",
    )
    begun = start([tmp_path / "drop.csv"])
    assert "\nuse: [" in begun.signals
    (tmp_path / "signals.yaml").write_text(begun.signals, encoding="utf-8")
    record = load(tmp_path / "drop.csv", tmp_path / "signals.yaml")
    assert record.duration == pytest.approx(6.5, abs=0.2)


def test_what_is_used_may_be_told_since_1970_or_from_the_first_row(tmp_path):
    for part in ("[5, 15]", "[1700000005, 1700000015]"):
        record = table(tmp_path, 1.7e9, f"use: {part}\n")
        assert (record.output.time[0], record.output.time[-1]) == pytest.approx((5.0, 15.0), abs=0.02)
