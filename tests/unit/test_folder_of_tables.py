"""A folder with one table for each stream of a recording."""

import numpy as np
import pytest

from rhythmid.errors import InputError
from rhythmid.record.folder_of_tables import size_of
from rhythmid.record.inventory import inventory
from rhythmid.record.load import load
from rhythmid.start.start import start

BEGAN = 1.5e9


def stream(folder, name, rate, columns, began=BEGAN, duration=8.0):
    """Write `name`.csv with columns of the time [s], from stamps of its own."""
    rng = np.random.default_rng(len(name))
    time = np.sort(
        np.arange(0.0, duration, 1.0 / rate) + rng.uniform(0.0, 0.2 / rate, round(duration * rate))
    )
    table = np.column_stack([began + time, *(law(time) for law in columns.values())])
    folder.mkdir(exist_ok=True)
    np.savetxt(
        folder / f"{name}.csv",
        table,
        delimiter=",",
        fmt="%.9f",
        header=",".join(["time", *columns]),
        comments="",
    )


def arm(folder):
    """The log of an arm with two joints: measured and commanded angles and the currents, each in its own table."""
    first, second = (lambda t: 0.4 * np.sin(3.0 * t)), (lambda t: 0.2 * np.cos(2.0 * t))
    stream(folder, "state", 100.0, {"j0": first, "j1": second})
    stream(folder, "cmd", 50.0, {"j0": lambda t: first(t + 0.05), "j1": lambda t: second(t + 0.05)})
    stream(
        folder,
        "motor",
        90.0,
        {"curr0": lambda t: 2.0 * np.sin(3.0 * t + 0.1), "curr1": lambda t: np.cos(2.0 * t + 0.1)},
    )
    (folder / "empty.csv").write_text("time,x\n", encoding="utf-8")
    return folder


def test_the_tables_of_one_recording_are_read_as_one_and_each_keeps_its_stamps(tmp_path):
    begun = start([arm(tmp_path / "log")])
    roles = {role: choice.recorded.column for role, choice in begun.guess.roles.choices.items()}
    assert roles["output"] == "state.j0" and "motor.curr0" in roles.values()
    assert any("empty.csv" in note for note in begun.guess.inventory.notes)
    (tmp_path / "signals.yaml").write_text(begun.signals, encoding="utf-8")
    record = load(tmp_path / "log", tmp_path / "signals.yaml")
    assert (record.name, len(record.output)) == ("log", 800)
    np.testing.assert_allclose(
        record.output.value, 0.4 * np.sin(3.0 * (record.output.time + _first(tmp_path))), atol=1e-4
    )


def _first(folder):
    """Time [s] of the first row of the tables after the beginning."""
    return min(
        float(np.loadtxt(one, delimiter=",", skiprows=1, ndmin=2)[0, 0]) - BEGAN
        for one in (folder / "log").glob("[!e]*.csv")
    )


def test_runs_of_one_layout_and_runs_at_different_times_are_refused(tmp_path):
    for name in ("first", "second"):
        stream(tmp_path / "runs", name, 100.0, {"angle": np.sin}, began=0.0)
    with pytest.raises(InputError, match="same columns, so that they are several recordings"):
        inventory(tmp_path / "runs")
    stream(tmp_path / "days", "arm", 100.0, {"angle": np.sin})
    stream(tmp_path / "days", "motor", 100.0, {"current": np.sin}, began=BEGAN + 86400.0)
    with pytest.raises(InputError, match="not recorded at the same time"):
        inventory(tmp_path / "days")


def test_check_tells_the_size_of_all_tables(tmp_path):
    folder = arm(tmp_path / "log")
    assert size_of(folder) == sum(one.stat().st_size for one in folder.iterdir())


def test_tables_of_one_folder_without_times_are_read_by_the_rate_that_is_given(tmp_path):
    time = 0.004 * np.arange(800)
    angles = np.column_stack([0.3 * np.sin(3.0 * time), 0.1 * np.cos(5.0 * time)])
    for name, table in (("position", angles), ("torque", -2.0 * angles), ("filtered", angles[1:, 0])):
        np.savetxt(tmp_path / f"data_{name}.csv", table, delimiter=",")
    with pytest.raises(InputError, match="--rate HZ"):
        inventory(tmp_path)
    begun = start([tmp_path], rate=250.0)
    roles = {role: choice.recorded.column for role, choice in begun.guess.roles.choices.items()}
    assert roles == {"output": "data_position.0", "input": "data_torque.0"}
    signals = tmp_path.parent / "signals.yaml"
    signals.write_text(begun.signals, encoding="utf-8")
    np.testing.assert_allclose(load(tmp_path, signals).output.time, time)


def pair(folder, steps):
    """The angles of two joints that were asked for, and those that were measured 80 ms later, in tables with the same
    names and stamps."""
    time = np.cumsum(steps)
    folder.mkdir()
    for name, lag in (("asked", 0.0), ("reached", 0.08)):
        late = time - lag
        angles = [0.5 * np.sin(2.0 * late) + 0.2 * np.sin(5.0 * late), 0.1 * np.cos(3.0 * late)]
        table = np.column_stack([time, *angles])
        np.savetxt(folder / f"{name}.csv", table, delimiter=",", header="t,hip,knee", comments="")
    return folder


def test_tables_with_the_same_names_and_the_same_uneven_stamps_are_one_recording(tmp_path):
    uneven = 0.01 + np.random.default_rng(1).uniform(0.0, 1e-3, 900)
    begun = start([pair(tmp_path / "log", uneven)])
    roles = {role: choice.recorded.column for role, choice in begun.guess.roles.choices.items()}
    assert roles == {"output": "reached.hip", "input": "asked.hip"}
    assert begun.guess.roles.input_kind == "reference"
    with pytest.raises(InputError, match="several recordings"):
        inventory(pair(tmp_path / "even", np.full(900, 0.01)))


def test_a_table_of_nothing_but_times_is_the_clock_of_the_tables_with_as_many_rows(tmp_path):
    time = np.cumsum(np.full(800, 0.004))
    angles = np.column_stack([0.3 * np.sin(3.0 * time), 0.1 * np.cos(5.0 * time)])
    for name, table in (
        ("position", angles),
        ("torque", -2.0 * angles),
        ("filtered", angles[1:]),
        ("stamp", time),
    ):
        np.savetxt(tmp_path / f"data_{name}.csv", table, delimiter=",")
    begun = start([tmp_path])
    roles = {role: choice.recorded.column for role, choice in begun.guess.roles.choices.items()}
    assert roles == {"output": "data_position.0", "input": "data_torque.0"}
    assert [note.split(" ")[0] for note in begun.guess.inventory.notes] == ["data_filtered.csv"]


def test_stamps_in_ns_of_messages_in_bursts_are_those_of_the_even_ones_beside_them(tmp_path):
    """Of five messages that are sent within 0.3 ms, most steps are of 0.08 ms, which would be µs by their size."""
    began, folder = 1669909568 * 10**9, tmp_path / "run"
    folder.mkdir()
    bursts = (np.arange(0, 8 * 10**9, 10**8)[:, None] + np.arange(5) * 80_000).ravel()
    even = np.arange(0, 8 * 10**9, 10**8)
    for name, column, after in (("wrench", "force", bursts), ("state", "position", even)):
        rows = "\n".join(f"{began + one},{np.sin(one * 1e-9):.6f}" for one in after)
        (folder / f"{name}.csv").write_text(f"%time,{column}\n{rows}\n")
    found = inventory(folder)
    assert {one.column for one in found.recorded} == {"wrench.force", "state.position"}
    assert np.ptp(np.concatenate([one.time for one in found.recorded])) == pytest.approx(7.9, abs=0.01)
