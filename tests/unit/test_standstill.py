"""A machine that stands still is told from one that moves by little, and from one that noise drives."""

from pathlib import Path

import numpy as np
import pytest

from rhythmid.errors import InputError
from rhythmid.record.bag_report import quality_report
from rhythmid.record.record import Channel, Record
from rhythmid.record.standstill import standstill
from rhythmid.start.start import start

COUNT = 4000
TIME = np.arange(COUNT) * 0.0025
STEP = 6e-8  # rad, of the encoder


def made(output: np.ndarray, drive: np.ndarray | None = None, kind: str = "position") -> Record:
    return Record(
        "run",
        Channel(TIME, output, "rad"),
        None if drive is None else Channel(TIME, drive, "N*m"),
        output_kind=kind,  # pyright: ignore[reportArgumentType]
    )


def noise(seed: int = 1) -> np.ndarray:
    return np.random.default_rng(seed).normal(size=COUNT)


def averaged(value: np.ndarray, count: int) -> np.ndarray:
    """What a driver gives that averages so many samples."""
    return np.convolve(value, np.ones(count) / count, mode="same")


def test_an_encoder_that_flickers_by_a_few_steps_is_that_of_a_machine_that_stands_still() -> None:
    output = -0.2254 + STEP * np.round(averaged(3.0 * noise(), 4))
    holding = np.round(noise(2), 1)
    said = standstill(made(output, holding))
    assert said is not None and "stands still" in said and "steps of its resolution" in said


def test_a_flicker_between_two_counts_stands_still_however_it_lasts() -> None:
    said = standstill(made(STEP * np.round(0.5 + 0.6 * np.sin(TIME))))
    assert said is not None and "2 values" in said


def test_white_noise_that_goes_with_no_command_is_no_motion() -> None:
    said = standstill(made(1e-4 * noise(), np.sin(3.0 * TIME)))
    assert said is not None and "white noise" in said
    assert standstill(made(1e-4 * noise(), np.sin(3.0 * TIME)), buried=False) is None


@pytest.mark.parametrize("steps", [4.0, 40.0])
def test_a_small_swing_that_lasts_is_a_motion(steps: float) -> None:
    output = STEP * np.round(steps * np.sin(5.0 * TIME) + 0.5 * noise())
    assert standstill(made(output)) is None


def test_an_acceleration_that_a_white_force_makes_is_a_motion() -> None:
    force = noise()
    assert standstill(made(0.5 * force + 0.3 * noise(2), force, "acceleration")) is None


def test_a_lone_blow_in_noise_is_a_motion() -> None:
    output = noise()
    output[2000:2003] += 50.0
    assert standstill(made(output)) is None


def test_too_few_samples_tell_nothing() -> None:
    assert standstill(Record("run", Channel(TIME[:50], noise()[:50], "rad"))) is None


def test_check_and_init_say_in_one_line_that_the_machine_stands_still(tmp_path: Path) -> None:
    table = tmp_path / "rest.csv"
    angle = STEP * np.round(averaged(3.0 * noise(), 4))
    columns = np.column_stack([TIME, angle, np.round(noise(2), 2)])
    np.savetxt(table, columns, delimiter=",", header="t,angle,torque", comments="", fmt="%.12g")
    begun = start([table])
    (said,) = [line for line in begun.lines() if "stands still" in line]
    assert said.startswith("CHECK output: ") and "record it while it moves" in said
    assert "stands still" in begun.signals
    signals = tmp_path / "signals.yaml"
    signals.write_text(begun.signals)
    report = quality_report(table, signals)
    assert report.usable and [note for note in report.notes if "stands still" in note]
    assert not any(line.endswith("flawless") for line in report.lines())


def test_how_far_a_machine_at_rest_moves_is_told_without_the_values_that_are_exceptions() -> None:
    output = np.full(COUNT, -1033.0)
    output[0], output[1] = 1234.0, 67110626.0
    said = standstill(made(output, kind="acceleration"))
    assert said is not None and "never changes but for 2 of 4000 samples (1234, 6.71106e+07)" in said
    output[0], output[2::3] = -1033.0, -1032.0
    said = standstill(made(output, kind="acceleration"))
    assert said is not None and "moves by 1 rad in all but for 1 of 4000 samples (6.71106e+07)" in said


RESTING = np.full(COUNT, 0.25)
STICKS = "never changes, though the input reaches 0.4"


def table(path: Path, output: np.ndarray, duty: np.ndarray) -> Path:
    np.savez(path, t=TIME, duty=duty, speed=output)
    return path


def answered(duty: np.ndarray) -> np.ndarray:
    """The speed of a motor behind a lag of 0.1 s."""
    speed = np.zeros(COUNT)
    for k in range(COUNT - 1):
        speed[k + 1] = speed[k] + 0.0025 * (50.0 * duty[k] - speed[k]) / 0.1
    return speed


@pytest.mark.parametrize("count", [COUNT, 100])
def test_an_output_that_never_changes_under_a_drive_is_told_with_how_far_that_goes(count: int) -> None:
    time, output = TIME[:count], RESTING[:count]
    duty = Channel(time, np.linspace(0.0, 0.4, count), "1")
    said = standstill(Record("run", Channel(time, output, "rad/s"), duty, output_kind="velocity"))
    assert said is not None and STICKS in said and "static friction" in said


def test_check_notes_a_machine_that_stands_still_under_a_drive_and_goes_on(tmp_path: Path) -> None:
    (tmp_path / "signals.yaml").write_text(
        "time: {column: t}\ninput: {column: duty, unit: '1'}\noutput: {column: speed, unit: rad/s, kind: velocity}\n"
    )
    duty = np.where(TIME > 1.0, 0.4, 0.0)
    report = quality_report(table(tmp_path / "a.npz", 0.0 * RESTING, duty), tmp_path / "signals.yaml")
    assert report.usable and any(STICKS in note for note in report.notes)
    with pytest.raises(InputError, match="never changes"):
        quality_report(table(tmp_path / "b.npz", 0.0 * RESTING, 0.0 * duty), tmp_path / "signals.yaml")


def test_a_controller_that_holds_its_place_drives_nothing() -> None:
    held = Record("run", Channel(TIME, RESTING, "rad"), Channel(TIME, RESTING, "rad"), input_kind="reference")
    said = standstill(held)
    assert said is not None and "though" not in said


def test_init_guesses_from_the_first_recording_in_which_the_machine_moves(tmp_path: Path) -> None:
    duty = np.clip(0.5 + 0.5 * np.sin(2.0 * TIME) + 0.3 * np.sin(7.3 * TIME), 0.0, 1.0)
    rests = table(tmp_path / "a.npz", 0.0 * RESTING, np.where(TIME > 1.0, 0.4, 0.0))
    moves = table(tmp_path / "b.npz", answered(duty), duty)
    found = start([rests, moves])
    assert {role: str(one.recorded) for role, one in found.guess.roles.choices.items()} == {
        "output": "speed",
        "input": "duty",
    }
    assert found.lines()[0] == f"{rests}: the machine stands still, so that it is not used here"
    assert start([moves]).model == found.model
    assert start([moves, rests]).model == found.model
