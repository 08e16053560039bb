"""Where a table has two clocks that disagree, both init and check say so, and the one that was read is taken."""

from pathlib import Path

import numpy as np
import pytest

from rhythmid.record.bag_report import quality_report
from rhythmid.record.inventory import inventory

ROWS = 2000
COUNTED = 0.8 + 0.002 * np.arange(ROWS)


def read_clock(step: float) -> np.ndarray:
    """Times that a program read, `step` s apart and a little late."""
    late = np.abs(np.random.default_rng(1).normal(size=ROWS)) * 0.05 * step
    return step * np.arange(ROWS) + late


def table(folder: Path, **columns: np.ndarray) -> Path:
    path = folder / "run.csv"
    columns["angle"] = np.sin(5.0 * COUNTED)
    np.savetxt(
        path, np.column_stack(list(columns.values())), delimiter=",", header=",".join(columns), comments=""
    )
    return path


def report(path: Path, clock: str) -> list[str]:
    signals = path.with_name("signals.yaml")
    signals.write_text(f"time: {{column: {clock}}}\noutput: {{column: angle, unit: rad}}\ninput: none\n")
    return [note for note in quality_report(path, signals).notes if "two clocks" in note]


@pytest.mark.parametrize("order", [("timestamp", "real_time"), ("real_time", "timestamp")])
def test_of_a_counted_and_a_read_clock_that_disagree_the_read_one_is_taken(
    tmp_path: Path, order: tuple[str, str]
) -> None:
    columns = {"timestamp": COUNTED, "real_time": read_clock(0.00396)}
    path = table(tmp_path, **{name: columns[name] for name in order})
    found = inventory(path)
    assert found.clock.column == "real_time"
    (note,) = [note for note in found.notes if "two clocks" in note]
    assert "timestamp" in note and "3.96" in note and "2 ms" in note
    (warned,) = report(path, "timestamp")
    assert "to be trusted more" in warned
    assert len(report(path, "real_time")) == 1


def test_clocks_that_agree_are_not_spoken_of(tmp_path: Path) -> None:
    path = table(tmp_path, timestamp=COUNTED, real_time=1.7e9 + read_clock(0.002 * 1.0001))
    found = inventory(path)
    assert found.clock.column == "timestamp" and not found.notes and not report(path, "timestamp")


def test_a_simulations_time_is_kept_beside_the_wall_clock(tmp_path: Path) -> None:
    found = inventory(table(tmp_path, sim_time=COUNTED, host_time=read_clock(0.01)))
    assert found.clock.column == "sim_time" and "two clocks" in found.notes[0]
