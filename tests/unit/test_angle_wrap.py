"""An output that jumps where an angle is read within a turn is noted by `check`; motions that are merely fast are not."""

import numpy as np
import pytest

from rhythmid.record.angle_wrap import wrap_notes
from rhythmid.record.bag_report import quality_report
from rhythmid.record.record import Channel, Record

TIME = 0.01 * np.arange(2000)
TURNING = 3.0 * np.sin(0.4 * TIME) + 1.3 * TIME  # rad


def noted(value: np.ndarray, unit: str = "rad") -> tuple[str, ...]:
    return wrap_notes(Record("run", Channel(TIME, value, unit)))


@pytest.mark.parametrize(("turn", "name"), [(2.0 * np.pi, "2π"), (np.pi, "π")])
@pytest.mark.parametrize("begin", [0.0, -np.pi])
def test_an_angle_within_a_turn_or_half_of_one_is_noted_with_its_jumps(turn, name, begin):
    value = (TURNING - begin) % turn + begin
    (note,) = noted(value)
    count = int((np.abs(np.diff(value)) > 0.5 * turn).sum())
    assert note.startswith(f"output: it jumps by {name} rad {count} times")
    held = value[4 * (np.arange(len(value)) // 4)]  # a reading stands for several rows
    assert noted(held)


@pytest.mark.parametrize(
    "value",
    [
        TURNING,
        np.where(np.sin(TIME) > 0.0, 2.0 * np.pi, 0.0) + 0.01 * np.sin(7.0 * TIME),
        np.sin(TIME) + 2.0 * np.pi * (np.arange(2000) == 700),
        np.pi * np.sin(150.0 * TIME),
    ],
    ids=["unwrapped", "two positions", "outlier", "coarsely sampled"],
)
def test_what_does_not_go_on_against_its_jumps_by_a_turn_is_no_wrapped_angle(value):
    assert noted(value) == ()


def test_a_length_has_no_turn():
    assert noted(TURNING % (2.0 * np.pi), "m") == ()


def test_check_says_it(tmp_path):
    rows = (f"{t:.2f},{y:.6f}" for t, y in zip(TIME, TURNING % (2.0 * np.pi)))
    (tmp_path / "run.csv").write_text("\n".join(["t,angle", *rows]) + "\n")
    (tmp_path / "signals.yaml").write_text(
        "time: {column: t}\ninput: none\noutput: {column: angle, unit: rad}\n"
    )
    lines = quality_report(tmp_path / "run.csv", tmp_path / "signals.yaml").lines()
    assert any("jumps by 2π rad" in line for line in lines)
