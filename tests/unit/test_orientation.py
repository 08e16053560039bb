"""Angles of orientations that messages give as quaternions."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from foreign import STORE, message, write
from scipy.spatial.transform import Rotation

from rhythmid.errors import InputError
from rhythmid.record.field import Field
from rhythmid.record.inventory import inventory
from rhythmid.record.orientation import angle_of
from rhythmid.record.read import read_record
from rhythmid.record.signals import Signals
from rhythmid.start.start import guess
from rhythmid.start.stated import Stated

TIME = 1.7e9 + np.arange(600) * 0.02
ROLL = 0.8 * np.sin(3.0 * (TIME - TIME[0]))
FIELDS = {"roll": ROLL, "pitch": 0.1 + 0.2 * ROLL, "yaw": -0.4 * ROLL}


def pose(time: float, angles: Any) -> Any:
    kinds = STORE.types
    x, y, z, w = Rotation.from_euler("xyz", angles).as_quat()
    whole = kinds["geometry_msgs/msg/Pose"](
        kinds["geometry_msgs/msg/Point"](x=0.01 * angles[0], y=0.0, z=1.0),
        kinds["geometry_msgs/msg/Quaternion"](x=x, y=y, z=z, w=w),
    )
    return message("geometry_msgs/msg/PoseStamped", time, pose=whole)


@pytest.fixture(scope="module")
def bag(tmp_path_factory) -> Path:
    """A machine that is moved by hand, under motion capture."""
    rows = np.column_stack(list(FIELDS.values()))
    poses = [(t, pose(t, row)) for t, row in zip(TIME, rows)]
    return write(tmp_path_factory.mktemp("orientation") / "bag", {"/rig/pose": poses})


def read(bag: Path, field: str) -> Any:
    output = f"output: {{topic: /rig/pose, field: {field}, unit: rad}}"
    return read_record(bag, Signals.from_text(f"time: header\ninput: none\n{output}\n"))


@pytest.mark.parametrize("name", list(FIELDS))
def test_an_angle_of_an_orientation_is_a_field_of_it(bag, name):
    assert read(bag, f"pose.orientation.{name}").output.value == pytest.approx(FIELDS[name], abs=1e-9)


def test_init_names_the_angles_and_takes_the_one_that_is_said_to_be_the_motion(bag):
    assert any("pose.orientation.yaw" in line for line in inventory(bag).left_out)
    stated = Stated.of(["output=/rig/pose pose.orientation.roll"], [])
    choice = guess(bag, stated=stated).roles.choices["output"]
    assert (choice.recorded.field, choice.recorded.unit) == ("pose.orientation.roll", "rad")


def test_a_number_called_yaw_of_a_message_that_is_no_quaternion_is_itself():
    types = {"own/msg/Euler": ([], [("yaw", (1, ("float64", 0)))])}
    assert Field.parse("yaw").components("own/msg/Euler", types) == (Field.parse("yaw"),)


def test_an_orientation_that_nobody_set_has_no_angle():
    parts = np.array([[0.0, 0.0, 0.0, 0.0], [0.0, 0.0, np.sin(0.2), np.cos(0.2)]]).T
    assert np.isnan(angle_of("yaw", parts)[0])
    assert angle_of("yaw", parts)[1] == pytest.approx(0.4)


def test_another_word_after_an_orientation_is_refused(bag):
    with pytest.raises(InputError, match="has no field 'yow'"):
        read(bag, "pose.orientation.yow")
