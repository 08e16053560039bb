"""A derivative of a position is no position: by its name, or because the numbers say so."""

import numpy as np
import pytest
from tables import write_columns

from rhythmid.record.inventory import Recorded, inventory
from rhythmid.start.meaning import derivative_of, is_ignored, meaning_of
from rhythmid.start.roles import guess_roles

TIME = 0.01 * np.arange(1500)


def said(name: str) -> Recorded:
    return Recorded(name, TIME, TIME, column=name)


@pytest.mark.parametrize(
    ("name", "quantity"),
    [
        ("sway_angle", "position"),
        ("sway_angle_first_derivative", "velocity"),
        ("sway_angle_second_derivative", "acceleration"),
        ("angle_derivative", "velocity"),
        ("x_dot", "velocity"),
        ("theta_ddot", "acceleration"),
        ("d_theta", "velocity"),
        ("dd_x", "acceleration"),
        ("velocity_derivative", "acceleration"),
        ("dy_obs", "velocity"),
        ("first_joint_angle", "position"),
        ("d_axis_current", "effort"),
    ],
)
def test_a_name_of_a_derivative_says_its_quantity(name, quantity):
    assert meaning_of(said(name)).quantity == quantity


@pytest.mark.parametrize(
    "name", ["sway_angle_third_derivative", "joint_jerk", "accel_dot", "motor_current_derivative"]
)
def test_a_jerk_or_a_rate_of_an_effort_is_neither_motion_nor_drive(name):
    assert is_ignored(said(name))


def test_plain_names_state_no_derivative():
    assert not any(
        derivative_of(said(name)) for name in ("dist", "deriver_pos", "position", "d", "knee_second")
    )
    assert meaning_of(said("trolley_position_first_derivative")).joint == "trolley"


def written(path, columns: dict[str, np.ndarray]):
    return inventory(write_columns(path, {"time": TIME} | columns))


def trolley() -> tuple[np.ndarray, np.ndarray]:
    drive = np.where(np.sin(1.3 * TIME) + np.sin(0.37 * TIME) > 0.0, 8.0, -8.0) * (TIME > 1.0)
    speed = np.zeros_like(TIME)
    for k in range(len(TIME) - 1):
        speed[k + 1] = speed[k] + 0.01 * (drive[k] / 8.0 - 2.0 * speed[k])
    return drive, 0.05 * np.cumsum(speed) * 0.01


def test_init_takes_the_moving_position_and_not_the_largest_derivative_of_another_one(tmp_path):
    drive, position = trolley()
    sway = 0.02 * np.sin(4.0 * TIME) + 1e-3 * np.random.default_rng(1).normal(size=len(TIME))
    rates = [sway]
    for _ in range(3):
        rates.append(np.gradient(rates[-1], TIME))
    names = ("sway_angle", *(f"sway_angle_{order}_derivative" for order in ("first", "second", "third")))
    columns = {
        "pwm_trolley_motor": drive * 80.0,
        "trolley_position": 10.0 * position,
        **dict(zip(names, rates, strict=True)),
    }
    roles = guess_roles(written(tmp_path / "run.csv", columns))
    assert roles.choices["output"].recorded.column == "trolley_position"
    assert roles.choices["input"].recorded.column == "pwm_trolley_motor"
    assert not roles.rotary


def test_a_number_that_is_the_derivative_of_another_is_its_speed(tmp_path):
    angle = np.sin(3.0 * TIME) + 0.4 * np.sin(7.0 * TIME)
    roles = guess_roles(written(tmp_path / "run.csv", {"angle": angle, "angle_b": np.gradient(angle, TIME)}))
    assert roles.choices["output"].recorded.column == "angle"
    assert roles.choices["velocity"].recorded.column == "angle_b"


def test_a_number_without_a_meaning_whose_derivative_was_recorded_is_the_motion_whatever_letters_stand_beside_it(
    tmp_path,
):
    rng = np.random.default_rng(4)
    moved = np.convolve(rng.standard_normal(len(TIME)), np.hanning(60) / 30.0, "same")
    speed = np.gradient(moved, TIME)
    supply = 2.0 + np.convolve(rng.standard_normal(len(TIME)), np.hanning(200) / 20.0, "same")
    table = {
        "t": TIME,
        "A": np.gradient(speed, TIME),
        "D": moved,
        "Y": supply,
        "V": speed,
        "F": 3.0 * speed + moved,
    }
    write_columns(tmp_path / "run.csv", table)
    roles = guess_roles(inventory(tmp_path / "run.csv")).choices
    assert {role: choice.recorded.column for role, choice in roles.items()} == {
        "output": "D", "velocity": "V", "input": "F",
    }  # fmt: skip
