"""A set point that never changes is a step that was made as the record began, where the output goes to it from elsewhere."""

from pathlib import Path

import numpy as np
import pytest

from rhythmid.start.start import guess, start

TIME = np.arange(1500) * 0.01
NOISE = np.random.default_rng(1).standard_normal(len(TIME))
RISE = 1.0 - np.exp(-TIME / 0.3)


def log(folder: Path, **columns: np.ndarray) -> Path:
    np.savez(folder / "run.npz", t=TIME, **columns)
    return folder / "run.npz"


@pytest.mark.parametrize(
    ("asked", "output", "kind"),
    [("setpoint_rpm", "actual_rpm", "velocity"), ("target_position", "position", "position"), ("speed_ref", "speed", "velocity")],
)  # fmt: skip
def test_a_constant_set_point_drives_a_machine_that_starts_away_from_it(tmp_path, asked, output, kind):
    columns = {asked: np.full(len(TIME), 100.0), output: 95.0 * RISE + NOISE}
    found = guess(log(tmp_path, **columns))
    roles = found.roles
    assert {role: str(one.recorded) for role, one in roles.choices.items()} == {
        "output": output,
        "input": asked,
    }
    assert (roles.input_kind, roles.reference_of, roles.output_kind) == ("reference", kind, kind)
    assert any(line.startswith("CHECK input: it never changes: taken for a step") for line in found.lines())


@pytest.mark.parametrize("asked", ["TargetCounts", "setpoint", "goal"])
def test_a_constant_that_was_asked_for_needs_no_quantity_where_the_output_goes_to_it(tmp_path, asked):
    found = guess(log(tmp_path, EncoderPosition=95.0 * RISE + NOISE, **{asked: np.full(len(TIME), 100.0)}))
    assert {role: str(one.recorded) for role, one in found.roles.choices.items()} == {
        "output": "EncoderPosition",
        "input": asked,
    }
    assert (found.roles.input_kind, found.roles.reference_of) == ("reference", "position")


def test_the_gain_of_a_step_is_told_by_how_fast_the_speed_rises(tmp_path):
    path = log(tmp_path, speed_ref=np.full(len(TIME), 10.0), speed=10.0 * RISE + 0.01 * NOISE)
    assert start([path]).nominal.model.value("velocity_control.gain") == pytest.approx(1.0 / 0.3, rel=0.3)


def steps(scale: float, offset: float) -> dict[str, np.ndarray]:
    """A drive that is asked for three speeds, and what a sensor of another scale and zero shows of them."""
    asked = np.repeat([25.0, 50.0, 35.0], 500)
    speed = np.empty(len(asked))
    speed[0] = asked[0]
    for k in range(1, len(asked)):
        speed[k] = speed[k - 1] + 0.01 * (asked[k - 1] - speed[k - 1]) / 0.2
    return {"speed_ref": asked, "speed": scale * speed + offset + 0.01 * NOISE}


def test_a_reference_and_a_speed_of_unlike_units_get_the_gain_and_the_offset_between_them(tmp_path):
    model = start([log(tmp_path, **steps(1.08, -6.8))]).nominal.model
    assert model.value("sensor_gain.gain") == pytest.approx(1.08, rel=0.02)
    assert model.value("sensor_offset.offset") == pytest.approx(-6.8, rel=0.1)
    assert model.value("velocity_control.gain") == pytest.approx(1.0 / 0.2, rel=0.3)


def test_a_speed_that_settles_at_its_reference_gets_neither_gain_nor_offset(tmp_path):
    model = start([log(tmp_path, **steps(1.0, 0.0))]).nominal.model
    assert [term.label for term in model.terms] == ["velocity_control"]


@pytest.mark.parametrize(
    "speed", [100.0 + NOISE, 500.0 * RISE + NOISE, -90.0 * RISE], ids=["there", "past it", "from it"]
)
def test_a_set_point_to_which_the_output_does_not_go_drives_nothing(tmp_path, speed):
    assert set(guess(log(tmp_path, speed_ref=np.full(len(TIME), 100.0), speed=speed)).roles.choices) == {
        "output"
    }


def test_an_effort_that_changes_comes_before_a_set_point_that_does_not(tmp_path):
    path = log(
        tmp_path, speed_ref=np.full(len(TIME), 100.0), speed=95.0 * RISE + NOISE, torque=np.exp(-TIME / 0.3)
    )
    assert str(guess(path).roles.choices["input"].recorded) == "torque"


def test_of_several_angles_the_one_that_goes_to_the_set_point_is_measured(tmp_path):
    columns = {
        "Consigne Angle (°)": np.full(len(TIME), 55.0),
        "Position Angulaire X (°)": 2.8 + 52.2 * RISE + 0.3 * NOISE,
        "Position Angulaire Y (°)": -126.0 + 122.0 * RISE + NOISE,
    }
    roles = guess(log(tmp_path, **columns)).roles
    assert {role: str(one.recorded) for role, one in roles.choices.items()} == {
        "input": "Consigne Angle (°)",
        "output": "Position Angulaire X (°)",
    }


@pytest.mark.parametrize(
    "name",
    ["Erreur I (°)", "error_deg", "Regelabweichung (deg)", "integral (deg)", "I-Term (deg)", "pos_err (deg)"],
)
def test_what_a_controller_computes_is_no_measured_position(tmp_path, name):
    error = 52.0 - 52.0 * RISE
    columns = {"Position (deg)": 52.0 - error + 0.1 * NOISE, name: np.cumsum(error)}
    assert str(guess(log(tmp_path, **columns)).roles.choices["output"].recorded) == "Position (deg)"
