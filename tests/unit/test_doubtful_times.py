"""Times that are not what they seem: a heading whose unit makes no date of them, and rows from before the clock began."""

from pathlib import Path

import numpy as np
import pytest

from rhythmid.record.heading import heading_of
from rhythmid.record.read import read_record
from rhythmid.record.signals import Signals
from rhythmid.record.stale_rows import stale_rows
from rhythmid.start.start import guess

STEPS = 0.01 * np.arange(400)
MOVED = np.sin(3.0 * STEPS) + 0.2 * np.sin(11.0 * STEPS)
FORCE = np.cos(3.0 * STEPS)


def table(folder: Path, heading: str, time: np.ndarray) -> Path:
    rows = [
        f"{t:.3f},{x:.6f},{f:.6f}"
        for t, x, f in zip(time, MOVED[: len(time)], FORCE[: len(time)], strict=True)
    ]
    path = folder / "run.csv"
    path.write_text("\n".join([f"{heading},position [m],force [N]", *rows]) + "\n")
    return path


@pytest.mark.parametrize(
    ("heading", "time", "scale"),
    [
        pytest.param("timestamp(ms)", 1771538684.155 + STEPS, 1.0, id="seconds called ms"),
        pytest.param("timestamp(s)", 1771538684155.0 + 1e3 * STEPS, 1e-3, id="ms called seconds"),
        pytest.param("timestamp(ms)", 1771538684155.0 + 1e3 * STEPS, 1e-3, id="ms"),
        pytest.param("time (ms)", 500.0 + 1e3 * STEPS, 1e-3, id="ms that are no date"),
    ],
)
def test_a_unit_of_times_that_makes_no_date_is_not_believed_where_another_one_does(
    tmp_path, heading, time, scale
):
    path = table(tmp_path, heading, time)
    found = guess(path)
    assert found.inventory.clock.scale == scale
    record = read_record(path, Signals.from_text(found.signals, "signals.yaml"))
    assert record.output.period == pytest.approx(0.01, rel=1e-3)
    assert not any("scale" in note for note in record.quality.notes)
    assert ("CHECK: the unit of its heading" in found.signals) == (scale != heading_of(heading).scale)


@pytest.mark.parametrize("count", [1, 3])
def test_rows_from_before_the_clock_began_are_left_out_and_told(tmp_path, count):
    time = np.concatenate([1.074 + 0.01 * np.arange(count), 0.008 + STEPS[: 400 - count]])
    path = table(tmp_path, "t", time)
    record = read_record(path, Signals.from_text(guess(path).signals, "signals.yaml"))
    assert len(record.output) == 400 - count
    (note,) = (note for note in record.quality.notes if "before the clock began" in note)
    assert note.startswith("run.csv: row 1 has" if count == 1 else "run.csv: rows 1 to 3 have")
    assert f"then 0.008 s in row {count + 1}" in note


def test_a_clock_that_is_set_back_later_or_more_than_once_is_no_stale_row():
    assert stale_rows(STEPS) == 0
    assert stale_rows(np.concatenate([STEPS[:50], STEPS])) == 0
    assert stale_rows(np.concatenate([[9.0], STEPS[:100], STEPS[:100]])) == 0


@pytest.mark.parametrize(
    ("heading", "unit", "scale"),
    [
        ("velocity (in/s)", "m/s", 0.0254), ("friction force (kip)", "N", 4448.2216152605), ("duty [%]", "1", 0.01),
        ("torque (lbf-ft)", "N*m", 1.3558179483314), ("speed [rev/s]", "rad/s", 2.0 * np.pi), ("lift (feet)", "m", 0.3048),
    ],
)  # fmt: skip
def test_headings_tell_units_of_other_systems(heading, unit, scale):
    found = heading_of(heading)
    assert (found.unit, found.scale) == (unit, pytest.approx(scale))
