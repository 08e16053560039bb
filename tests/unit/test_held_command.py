"""A command that comes as an event is in force until the next one, which its samples show beside those of the output."""

from pathlib import Path

import numpy as np
import pytest
from foreign import array, joint_state, moved, write

from rhythmid.record.bag_report import quality_report
from rhythmid.record.read import read_record
from rhythmid.record.timing import Timing
from rhythmid.start.start import guess

TIME = 0.002 * np.arange(6000)
OUTPUT = np.sin(2.0 * TIME) + 0.3 * np.sin(5.1 * TIME)
EVENTS = [(0.0101, 0.2), (1.7303, -0.1), (4.2107, 0.3), (6.0009, -0.3), (9.4411, 0.1)]


def written(folder: Path, given: list[tuple[float, float]], hold: str = "") -> Path:
    """A table of rows of an output at 500 Hz, and of an input with stamps of its own."""
    rows = sorted(
        [(t, f"{t:.6f},,{y:.9g}") for t, y in zip(TIME, OUTPUT)]
        + [(t, f"{t:.6f},{u:.9g},") for t, u in given]
    )
    (folder / "run.csv").write_text("\n".join(["t,torque,angle", *(row for _, row in rows)]) + "\n")
    (folder / "signals.yaml").write_text(
        f"time: {{column: t}}\ninput: {{column: torque{hold}}}\noutput: {{column: angle}}\n"
    )
    return folder / "run.csv"


def read(folder: Path, given: list[tuple[float, float]], hold: str = "") -> str:
    return read_record(written(folder, given, hold), folder / "signals.yaml").hold


def test_an_input_of_few_steps_is_held_until_the_next_one_and_check_says_so(tmp_path):
    assert read(tmp_path, EVENTS) == "zero"
    lines = quality_report(tmp_path / "run.csv", tmp_path / "signals.yaml").lines()
    assert any(
        "input: its 5 samples" in line and "held until the next one (hold: zero)" in line for line in lines
    )


def test_what_signals_yaml_says_of_the_hold_counts(tmp_path):
    assert read(tmp_path, EVENTS, ", hold: linear") == "linear"
    lines = quality_report(tmp_path / "run.csv", tmp_path / "signals.yaml").lines()
    assert not any("held until" in line for line in lines)


@pytest.mark.parametrize("scale", [1e-3, 1e4])
def test_random_levels_are_held_whatever_their_unit(tmp_path, scale):
    levels = scale * np.random.default_rng(1).standard_normal(60)
    assert read(tmp_path, list(zip(0.2003 * np.arange(60) + 0.001, levels))) == "zero"


def test_a_sparse_input_that_its_samples_resolve_was_measured(tmp_path):
    time = 0.1 * np.arange(120) + 0.001
    assert read(tmp_path, list(zip(time, np.sin(2.0 * time)))) == "band_limited"


def test_a_rough_input_nearly_as_dense_as_the_output_was_measured(tmp_path):
    time = 0.004 * np.arange(3000) + 0.001
    assert read(tmp_path, list(zip(time, np.random.default_rng(1).standard_normal(3000)))) == "band_limited"


def test_init_writes_the_hold_with_its_reason(tmp_path):
    text = guess(written(tmp_path, EVENTS)).signals
    (line,) = [line for line in text.splitlines() if line.startswith("input:")]
    assert "hold: zero" in line and "change in steps and are far sparser" in " ".join(text.split())


def test_an_effort_whose_messages_have_no_stamps_is_held_in_a_bag(tmp_path):
    time, force = 0.01 * np.arange(2000), np.repeat(np.random.default_rng(2).standard_normal(1000), 2)
    states = [
        (t, joint_state(t, ["slide"], position=[x])) for t, x in zip(time, moved(force, 1.0, 2.0, 30.0)[0])
    ]
    at = (time < 12.0) | (time > 14.0)  # the program has ended with zero, and its guard sends zeros later
    sent = [(t + 1e-4, array([u * (t < 11.9)])) for t, u in zip(time[at], force[at])]
    bag = write(tmp_path / "bag", {"/axes": states, "/forces": sent})
    text = guess(bag).signals
    assert "hold: linear}" not in text and "messages have no stamps, as those of commands" in " ".join(
        text.split()
    )
    (tmp_path / "signals.yaml").write_text(text)
    report = quality_report(bag, tmp_path / "signals.yaml")
    assert (report.channels["input"].timing.gaps, report.channels["input"].timing.lost) == (0, 0)
    assert report.cut is not None and not report.cut.gaps


def test_a_held_command_that_differs_after_a_gap_is_missing():
    time = np.delete(0.01 * np.arange(1000), [*range(300, 320), *range(600, 605)])
    value = np.where(time < 4.0, 1.0, np.where(time < 6.02, 2.0, 3.0))
    every, held = Timing.of(time), Timing.of(time).of_held(time, value)
    assert (every.gaps, every.lost) == (2, 25)
    assert (held.gaps, held.lost) == (1, 5) and held.longest_gap == pytest.approx(0.06)
