"""Logs that say in every row what each number is; lines between the rows are passed over, and told."""

from pathlib import Path

import numpy as np
import pytest

from rhythmid.record.bag_report import quality_report
from rhythmid.record.labelled_rows import pairs_of
from rhythmid.record.table import Table
from rhythmid.start.start import guess

COUNT = 400
STEPS = np.tile([3, 2, 2, 3, 13, 2, 14], COUNT)[: COUNT - 1]
STEPS[200] = 18000  # a pause
TIMES = 5001 + np.concatenate([[0], np.cumsum(STEPS)])
ANGLE = np.round(300.0 * np.sin(np.arange(COUNT) / 20.0))
CURRENT = np.round(100.0 * np.cos(np.arange(COUNT) / 20.0) + 500.0)
PROSE = "POSITIONING WITH REVSPEED: 1000, DELTAPOS: 0.49, DELTATIME: 2.70"


def log(folder: Path, row: str, *prose: str) -> Path:
    lines = [row.format(t=t, x=x, i=i) for t, x, i in zip(TIMES, ANGLE, CURRENT, strict=True)]
    for place, line in enumerate(prose):
        lines.insert(250 + 20 * place, line)
    path = folder / "run.txt"
    path.write_text("\n".join(lines) + "\n")
    return path


@pytest.mark.parametrize(
    ("row", "names"),
    [
        ("Time: {t} Position: {x:g} Current: {i:g}", ["Time", "Position", "Current"]),
        ("time={t},position={x:g},current={i:g}", ["time", "position", "current"]),
        ("Time: {t} ms; Motor position: {x:g}deg; Motor current: {i:g} mA", ["Time [ms]", "Motor position [deg]", "Motor current [mA]"]),
        ("Time: {t} ms Motor position: {x:g} deg Motor current: {i:g} mA", ["Time [ms]", "Motor position [deg]", "Motor current [mA]"]),
        ("  t = {t} | pos = {x:.3e} | cur = {i:+.1f} |", ["t", "pos", "cur"]),
    ],
)  # fmt: skip
def test_labels_in_front_of_the_numbers_are_the_names_of_columns(tmp_path, row, names):
    table = Table.load(log(tmp_path, row))
    assert list(table.columns) == names and not table.notes
    for name, value in zip(names, (TIMES, ANGLE, CURRENT), strict=True):
        np.testing.assert_allclose(table.column(name), value, atol=0.5)


def test_sentences_between_the_rows_are_passed_over_and_told(tmp_path):
    path = log(
        tmp_path, "Time: {t} Position: {x:g} Current: {i:g}", PROSE, "DONE POSITIONING", "Time: 5001 Positi"
    )
    found = guess(path)
    assert found.inventory.clock.column == "Time"
    assert str(found.roles.choices["output"].recorded) == "Position"
    (told,) = [line for line in found.lines() if "passed over" in line]
    assert told.startswith("CHECK 3 lines") and "the first line 251 (POSITIONING WITH" in told
    (tmp_path / "signals.yaml").write_text(found.signals)
    assert any("3 lines" in note for note in quality_report(path, tmp_path / "signals.yaml").notes)


@pytest.mark.parametrize(
    "line",
    ["", "12:30:05 7", "DONE", "a: b", '{"a": 1, "b": 2}', "a: 1 and then", "1: 2", "# a: 1", "a: 1 2 3"],
)
def test_other_lines_hold_no_pairs(line):
    assert pairs_of(line) == [] or line.startswith("#")


def test_a_head_of_labelled_numbers_makes_no_log_of_a_table(tmp_path):
    rows = "".join(f"{k * 0.01:.2f},{np.sin(k):.5f}\n" for k in range(300))
    (tmp_path / "run.csv").write_text(f"Rate: 100\nGain: 3\nt,angle\n{rows}")
    assert list(Table.load(tmp_path / "run.csv").columns) == ["t", "angle"]
