"""A command that is logged more often than it is updated stands still between its steps, and is taken as held."""

from pathlib import Path

import numpy as np
import pytest

from rhythmid.errors import InputError
from rhythmid.excitation.sequence import build
from rhythmid.identify.identify import identify
from rhythmid.model import Model
from rhythmid.record.bag_report import quality_report
from rhythmid.record.held_command import update_interval
from rhythmid.record.read import read_record
from rhythmid.record.record import Channel
from rhythmid.simulation.signal import zero_order_hold
from rhythmid.simulation.simulate import simulate
from rhythmid.start.start import guess

RATE, LENGTH = 200.0, 20.0
TIME = np.arange(int(RATE * LENGTH)) / RATE
MODEL = Model.from_text(
    """
inertia: {mass: {value: 1.0, unit: kg, fixed: true}}
force:
  - linear_spring: {stiffness: {value: 200.0, unit: N/m}}
  - viscous_damper: {damping: {value: 2.0, unit: N*s/m}}
""",
    "model.yaml",
)
SMOOTH = build({"type": "multisine", "rms": 3.0, "period": 10.0, "periods": 2, "band": [0.3, 6.0], "seed": 1})


def interval(value: np.ndarray, answer: np.ndarray | None = None) -> float:
    output = np.sin(2.0 * TIME) if answer is None else answer
    return update_interval(Channel(TIME, value, "N"), Channel(TIME, output, "m"))


def updated(rate: float, first: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
    """Instants and values of a command that is updated at a rate of its own."""
    instants = np.concatenate([[0.0], np.arange(0.0, LENGTH, 1.0 / rate)[1:] + first])
    return instants, SMOOTH(instants)


def logged(instants: np.ndarray, command: np.ndarray) -> np.ndarray:
    return command[np.searchsorted(instants, TIME + 1e-9, side="right") - 1]


def table(folder: Path, rate: float, column: str = "force", first: float = 0.0) -> Path:
    instants, command = updated(rate, first)
    position = simulate(MODEL, TIME, zero_order_hold(instants, command)).output
    position = position + np.random.default_rng(2).normal(0.0, 2e-5, len(TIME))
    rows = np.column_stack([TIME, logged(instants, command), position])
    np.savetxt(
        folder / "run.csv", rows, delimiter=",", header=f"t,{column},position", comments="", fmt="%.9g"
    )
    (folder / "signals.yaml").write_text(
        f"time: {{column: t}}\ninput: {{column: {column}, unit: N}}\noutput: {{column: position, unit: m}}\n"
    )
    return folder / "run.csv"


@pytest.mark.parametrize(("rate", "first"), [(50.0, 0.0), (100.0, 0.0), (25.0, 0.0), (50.0, 0.0021)])
def test_a_command_that_is_updated_more_slowly_than_it_is_logged_costs_no_delay(tmp_path, rate, first):
    record = read_record(table(tmp_path, rate, first=first), tmp_path / "signals.yaml")
    assert record.hold == "zero"
    late = identify([record], MODEL).delays.sum
    between = 1.0 / RATE if first else 0.0  # the table says only in which row the step was seen
    assert late.value is None or abs(late.value) < between + 1e-4


def test_identify_asks_whether_an_input_was_commanded_where_the_delay_is_half_an_interval(tmp_path):
    signals = tmp_path / "signals.yaml"
    record = read_record(table(tmp_path, RATE), signals)  # a new command in every row
    assert record.hold == "band_limited"
    (caution,) = identify([record], MODEL).cautions
    assert caution.name == "half_interval" and "hold: zero" in caution.question
    signals.write_text(signals.read_text().replace("unit: N}", "unit: N, hold: zero}"))
    assert not identify([read_record(tmp_path / "run.csv", signals)], MODEL).cautions


def test_check_says_that_it_is_taken_as_held_and_how_often_it_changes(tmp_path):
    lines = quality_report(table(tmp_path, 50.0), tmp_path / "signals.yaml").lines()
    assert any("stands still" in line and "0.02 s" in line and "hold: linear" in line for line in lines)


def test_init_writes_the_hold_of_a_command_whose_name_says_nothing(tmp_path):
    text = guess(table(tmp_path, 50.0)).signals
    (line,) = [line for line in text.splitlines() if line.startswith("input:")]
    assert "hold: zero" in line and "stands still" in " ".join(text.split())


@pytest.mark.parametrize("levels", [2, 5, 40])
def test_random_levels_are_held(levels):
    level = np.random.default_rng(3).integers(0, levels, len(TIME) // 10)
    assert interval(np.repeat(level, 10).astype(float)) > 0.0


@pytest.mark.parametrize("step", [0.01, 0.1, 1.0])
@pytest.mark.parametrize("noise", [0.0, 0.2, 0.5, 1.0, 3.0])
def test_a_measured_signal_that_is_rounded_is_not_held(step, noise):
    measured = SMOOTH(TIME) + noise * step * np.random.default_rng(4).standard_normal(len(TIME))
    assert interval(step * np.round(measured / step)) == 0.0


def test_a_measured_signal_at_its_limits_or_with_spikes_is_not_held():
    assert interval(np.clip(SMOOTH(TIME), -2.0, 2.0)) == 0.0
    spikes = np.zeros(len(TIME))
    spikes[np.random.default_rng(5).choice(len(TIME) // 3, 40, replace=False) * 3] = 1.0
    assert interval(spikes) == 0.0


def test_rows_that_repeat_all_channels_say_nothing_of_the_hold():
    copies = TIME[np.arange(len(TIME)) // 4 * 4]
    assert interval(SMOOTH(copies), np.sin(2.0 * copies)) == 0.0
    held = TIME[np.arange(len(TIME)) // 16 * 16]
    assert interval(SMOOTH(held), np.sin(2.0 * copies)) == pytest.approx(0.08)


def test_a_value_beyond_all_bounds_is_refused_in_one_line(tmp_path):
    text = table(tmp_path, RATE).read_text().splitlines()
    row = text[1000].split(",")
    text[1000] = ",".join([row[0], "1e308", row[2]])
    (tmp_path / "run.csv").write_text("\n".join(text) + "\n")
    with pytest.raises(InputError, match="1 of 4000 samples are infinite"):
        read_record(tmp_path / "run.csv", tmp_path / "signals.yaml")
