"""`rhythmid split`: a table of several recordings becomes a table for each."""

import json
from pathlib import Path

import numpy as np
import pytest

from rhythmid.errors import InputError
from rhythmid.record.grouped_runs import grouped_runs
from rhythmid.record.read import read_record
from rhythmid.record.signals import Signals
from rhythmid.record.split import recordings, split, split_runs
from rhythmid.record.table import Table

LENGTHS = (40, 60, 50)
TIME = np.concatenate([0.02 * np.arange(count) for count in LENGTHS])
EPISODE = np.repeat(np.arange(3), LENGTHS)
ANGLE = np.sin(TIME + EPISODE)
BOTH = np.column_stack([ANGLE, -ANGLE])
SIGNALS = "time: {column: timestamp}\ninput: none\noutput: {column: 'state[1]', unit: rad}\n"


def table(folder: Path, **more: np.ndarray) -> Table:
    np.savez(folder / "log.npz", timestamp=TIME, state=BOTH, **more)
    return Table.load(folder / "log.npz")


@pytest.mark.parametrize("more", [{"episode_index": EPISODE}, {}], ids=["by number", "by time"])
def test_each_recording_becomes_a_table_of_its_own(tmp_path, more):
    whole = table(tmp_path, **more)
    why, rows = recordings(whole)
    made = split(whole, rows, tmp_path / "parts")
    assert ("episode_index" in why) == bool(more) and [path.name for path in made] == [
        f"log_{k}.npz" for k in range(3)
    ]
    for number, path in enumerate(made):
        record = read_record(path, Signals.from_text(SIGNALS))
        np.testing.assert_array_equal(record.output.value, -ANGLE[EPISODE == number])


def test_a_column_of_ones_own_tells_recordings_apart(tmp_path):
    _, rows = recordings(table(tmp_path, side=np.where(EPISODE == 1, 7, 3)), "side")
    assert [len(rows[name]) for name in ("3", "7")] == [90, 60]


@pytest.mark.parametrize(
    ("columns", "by", "words"),
    [
        ({"timestamp": np.arange(50.0), "q": np.sin(np.arange(50.0))}, None, "tells 1 recordings apart"),
        ({"a": np.sin(np.arange(50.0))}, None, "name a column with --by"),
        ({"timestamp": TIME, "q": ANGLE}, "episode", "has no column 'episode'"),
        ({"timestamp": TIME, "q": np.where(EPISODE == 0, np.nan, ANGLE)}, "q", "does not number every row"),
    ],
)
def test_what_cannot_be_taken_apart_is_refused_in_one_line(tmp_path, columns, by, words):
    np.savez(tmp_path / "log.npz", **columns)
    with pytest.raises(InputError) as refused:
        recordings(Table.load(tmp_path / "log.npz"), by)
    assert words in str(refused.value) and "\n" not in str(refused.value)


def test_a_folder_that_exists_is_not_touched(tmp_path):
    whole = table(tmp_path, episode_index=EPISODE)
    (tmp_path / "parts").mkdir()
    with pytest.raises(InputError, match="parts: exists already"):
        split(whole, recordings(whole)[1], tmp_path / "parts")
    assert not list((tmp_path / "parts").iterdir())


def test_a_time_that_begins_anew_is_refused_with_what_takes_it_apart(tmp_path):
    table(tmp_path)
    with pytest.raises(InputError, match="time goes backwards.*rhythmid split"):
        read_record(tmp_path / "log.npz", Signals.from_text(SIGNALS))


def test_stamps_that_change_places_by_jitter_are_put_in_order(tmp_path):
    time = 1e-3 * np.arange(1000)
    time[500] = time[499] - 1e-4
    np.savez(tmp_path / "log.npz", timestamp=time, state=np.column_stack([time, np.sin(9.0 * time)]))
    record = read_record(tmp_path / "log.npz", Signals.from_text(SIGNALS))
    assert len(record.output) == 1000 and np.all(np.diff(record.output.time) > 0.0)


def test_a_column_may_have_any_name(tmp_path):
    lines = [f"{t},{e},{q}" for t, e, q in zip(TIME, EPISODE, ANGLE)]
    (tmp_path / "log.csv").write_text("\n".join(["timestamp,run,file", *lines]))
    whole = Table.load(tmp_path / "log.csv")
    first, *_ = split(whole, recordings(whole)[1], tmp_path / "parts")
    np.testing.assert_array_equal(Table.load(first).column("file"), ANGLE[EPISODE == 0])


def test_numbers_of_many_digits_stay_apart(tmp_path):
    _, rows = recordings(table(tmp_path, run=1_000_000_000 + EPISODE))
    assert list(rows) == ["1000000000", "1000000001", "1000000002"]


def test_a_folder_that_cannot_be_finished_leaves_nothing(tmp_path, monkeypatch):
    def full(*_: object, **__: object) -> None:
        raise OSError(28, "No space left on device")

    whole = table(tmp_path)
    monkeypatch.setattr("rhythmid.record.split.write_array", full)
    with pytest.raises(InputError, match="parts: cannot be written: No space left on device"):
        split(whole, recordings(whole)[1], tmp_path / "parts")
    assert [path.name for path in tmp_path.iterdir()] == ["log.npz"]


def in_arrays(folder: Path, **more: object) -> Table:
    """One list of rows for each recording, as WPILib's SysId writes them."""
    parts = np.split(np.column_stack([TIME + 7.0, ANGLE]), np.cumsum(LENGTHS)[:-1])
    runs = dict(
        zip(("fast-backward", "fast-forward", "slow-forward"), (part.tolist() for part in parts), strict=True)
    )
    (folder / "sysid.json").write_text(
        json.dumps({**runs, "test": "Simple", "unitsPerRotation": 6.28, **more})
    )
    return Table.load(folder / "sysid.json")


def test_recordings_that_are_an_array_each_become_tables(tmp_path):
    runs = grouped_runs(in_arrays(tmp_path))
    assert runs is not None and runs.note == "3 runs, fast-backward to slow-forward"
    made = split_runs(in_arrays(tmp_path), runs, tmp_path / "parts")
    assert [path.name for path in made] == [f"sysid_{name}.npz" for name in runs.members]
    np.testing.assert_array_equal(Table.load(made[1]).column("1"), ANGLE[EPISODE == 1])


def test_arrays_beside_another_array_are_no_recordings(tmp_path):
    assert grouped_runs(in_arrays(tmp_path, gains=[1.0, 2.0, 3.0])) is None
