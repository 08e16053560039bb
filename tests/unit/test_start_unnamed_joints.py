"""Tables without names that hold several joints: the joint that moves most is looked at, and no number of another one."""

from pathlib import Path

import numpy as np
import pytest
from foreign import STEP, moved, roles_of, tones

from rhythmid.errors import InputError
from rhythmid.start.start import guess

FINE = np.arange(16000) * STEP
TIME = FINE[::5]
SIZES = (0.2, 1.0, 0.4)


def joint(seed: int, size: float) -> list[np.ndarray]:
    """Position, velocity, effort and acceleration of a driven mass on a spring."""
    force = size * tones(seed, FINE, 3.0, 0.3, 2.0)
    position, speed = moved(force, 0.5, 1.0, 5.0)
    acceleration = (force - speed - 5.0 * position) / 0.5
    noise = 1e-4 * size * np.random.default_rng(seed).standard_normal(len(TIME))
    return [value[::5] + noise for value in (position, speed, force, acceleration)]


def table(folder: Path, columns: list[np.ndarray]) -> Path:
    np.savetxt(folder / "run.csv", np.column_stack([TIME, *columns]), delimiter=",")
    return folder / "run.csv"


@pytest.fixture
def joints() -> list[list[np.ndarray]]:
    return [joint(seed, size) for seed, size in enumerate(SIZES)]


def groups(joints: list[list[np.ndarray]], *order: int) -> list[np.ndarray]:
    return [one[what] for what in order for one in joints]


def test_of_groups_of_columns_the_joint_that_moves_most_is_taken(tmp_path, joints) -> None:
    source = table(tmp_path, groups(joints, 0, 1, 2))
    assert roles_of(source) == {"output": "2", "velocity": "5", "input": "8"}
    found = guess(source).roles
    assert found.joint.name == "2" and found.joint.others == ["3", "1"]


def test_a_joint_is_asked_for_by_its_place(tmp_path, joints) -> None:
    source = table(tmp_path, groups(joints, 0, 1, 2))
    assert roles_of(source, joint="3") == {"output": "3", "velocity": "6", "input": "9"}
    with pytest.raises(InputError, match="no joint is called '4'; it has"):
        guess(source, joint="4")


def test_efforts_may_come_first_and_a_joint_may_stand_still(tmp_path, joints) -> None:
    joints.append([np.full(len(TIME), 0.3), np.zeros(len(TIME)), np.zeros(len(TIME))])
    source = table(tmp_path, groups(joints, 2, 0, 1))
    assert roles_of(source) == {"output": "6", "velocity": "10", "input": "2"}
    with pytest.raises(InputError, match="joint '4' stands still"):
        guess(source, joint="4")


def test_an_acceleration_makes_no_velocity_a_position(tmp_path, joints) -> None:
    assert roles_of(table(tmp_path, groups(joints, 0, 1, 3, 2)))["output"] == "2"
    alone = table(tmp_path, [joints[1][what] for what in (0, 1, 3, 2)])
    assert roles_of(alone)["output"] == "1"


def test_of_joints_one_behind_the_other_the_one_that_moves_most_is_taken(tmp_path, joints) -> None:
    source = table(tmp_path, [value for one in joints for value in one[:3]])
    assert roles_of(source) == {"output": "4", "velocity": "5", "input": "6"}
