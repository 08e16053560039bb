"""An output that stops although it is driven as before, and one that is held before it is let go, are told by `check` and `identify`."""

import numpy as np
import pytest
from tables import write_columns

from rhythmid.identify.identify import identify
from rhythmid.model import Model
from rhythmid.record.bag_report import quality_report
from rhythmid.record.cleaning import cleaned
from rhythmid.record.load import load
from rhythmid.record.record import Channel, Record
from rhythmid.start.start import start

PERIOD = 0.01  # s
TIME = PERIOD * np.arange(4000)
STEPS = np.where(TIME % 4.0 >= 2.0, 8.0, 0.0)


def speed_of(drive: np.ndarray) -> np.ndarray:
    """Speed of a machine of a time constant of 0.2 s, rounded by its encoder."""
    speed = np.zeros(len(drive))
    for k in range(1, len(drive)):
        speed[k] = speed[k - 1] + PERIOD / 0.2 * (drive[k - 1] - speed[k - 1])
    return 0.05 * np.round(speed / 0.05)


def told(speed: np.ndarray, drive: np.ndarray | None) -> tuple[str, ...]:
    given = None if drive is None else Channel(TIME, drive, "V")
    record = Record("run", Channel(TIME, speed, "rad/s"), input=given, output_kind="velocity", hold="zero")
    return cleaned(record).told


@pytest.mark.parametrize("last", [20.0, 32.0])
def test_an_output_that_stops_while_the_same_steps_go_on_is_told(last):
    (note,) = told(np.where(last > TIME, speed_of(STEPS), 0.0), STEPS)
    assert f"stands still from t = {last:g} s to the end" in note and f"use: [0, {last:g}]" in note


@pytest.mark.parametrize(
    "drive",
    [np.where(TIME < 24.0, STEPS, 0.0), np.where(TIME < 24.0, STEPS, 0.002 * STEPS)],
    ids=["no drive at the end", "a drive that is too small"],
)
def test_a_machine_that_is_driven_less_at_the_end_may_rest(drive):
    assert told(speed_of(drive), drive) == ()


def test_a_machine_that_also_rested_before_under_such_a_drive_may_rest_at_the_end():
    moves = (TIME < 2.0) | ((TIME > 20.0) & (TIME < 22.0))
    assert told(np.where(moves, np.sin(3.0 * TIME), 0.0), np.sin(7.0 * TIME)) == ()


def test_one_whose_last_drive_is_too_fast_for_it_may_rest():
    drive = np.where(TIME < 24.0, 0.4 * STEPS, 3.2 * (np.arange(len(TIME)) % 2))
    speed = 0.5 * np.round(speed_of(drive) / 0.5)
    assert np.ptp(speed[-1000:]) == 0.0 and told(speed, drive) == ()


def swing(begin: float, held: float, damping: float = 0.1) -> np.ndarray:
    """A free swing about 0.5 rad, held at `begin` for a while."""
    since = np.maximum(TIME - held, 0.0)
    free = 0.5 + (begin - 0.5) * np.exp(-damping * since) * np.cos(4.0 * since)
    return free + 1e-4 * np.random.default_rng(0).standard_normal(len(TIME))


def test_a_swing_that_is_held_before_it_is_let_go_is_told():
    (note,) = told(swing(1.2, 1.0), None)
    assert "rests for the first 1" in note and "use: [1" in note


def test_a_rest_before_a_push_is_told():
    since = np.maximum(TIME - 1.0, 0.0)
    (note,) = told(np.exp(-0.1 * since) * np.sin(4.0 * since), None)
    assert "rests for the first 1" in note


@pytest.mark.parametrize("held", [0.0, 0.05])
def test_a_swing_that_begins_at_its_turning_point_is_free_from_the_start(held):
    assert told(swing(1.2, held), None) == ()


def test_a_machine_that_is_driven_may_rest_before_it_is():
    drive = np.where(TIME > 3.0, STEPS, 0.0)
    assert told(speed_of(drive), drive) == ()


def test_init_begins_each_of_several_records_where_it_is_free(tmp_path):
    for name, held in (("one", 1.0), ("two", 0.0), ("three", 2.0)):
        write_columns(tmp_path / f"{name}.csv", {"t": TIME, "angle": swing(1.2, held)})
    sources = [tmp_path / f"{name}.csv" for name in ("one", "two", "three")]
    begun = start(sources)
    (tmp_path / "signals.yaml").write_text(begun.signals)
    first = [load(one, tmp_path / "signals.yaml").output.time[0] for one in sources]
    assert first == pytest.approx([1.05, 0.0, 2.05], abs=0.05)
    assert any("CHECK output: three: it rests for the first 2" in line for line in begun.lines())


def test_init_check_and_identify_say_from_where_a_swing_is_free(tmp_path):
    rows = (f"{t:.2f},{y:.6f}" for t, y in zip(TIME, swing(1.2, 1.0)))
    (tmp_path / "run.csv").write_text("\n".join(["t,angle", *rows]) + "\n")
    begun = start([tmp_path / "run.csv"])
    assert "\nuse: [1." in begun.signals and "rests for the first 1" in begun.signals
    held = begun.signals.replace("\nuse:", "\n# use:")
    (tmp_path / "signals.yaml").write_text(held)
    (tmp_path / "model.yaml").write_text(begun.model)
    lines = quality_report(tmp_path / "run.csv", tmp_path / "signals.yaml").lines()
    assert any("rests for the first 1" in line for line in lines)
    record = load(tmp_path / "run.csv", tmp_path / "signals.yaml")
    found = identify(record, Model.load(tmp_path / "model.yaml"))
    assert any("rests for the first 1" in note for note in found.notes)
