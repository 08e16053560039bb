"""Bags of vehicles: commands to the wheels, and where the vehicle is by its odometry or its tree of frames."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from foreign import STORE, joint_state, message, roles_of, write

from rhythmid.errors import InputError
from rhythmid.record.bag_report import quality_report
from rhythmid.record.read import read_record
from rhythmid.record.signals import Signals
from rhythmid.start.start import guess

RATE = 20.0  # Hz
TIME = 1.7e9 + np.arange(800) / RATE
COMMAND = np.where(np.arange(800) % 80 < 40, 0.4, -0.4)
SPEED = np.zeros(800)
for k in range(1, 800):
    SPEED[k] = SPEED[k - 1] + (COMMAND[k - 1] - SPEED[k - 1]) / RATE / 0.3
PLACE = np.cumsum(SPEED) / RATE
VECTOR = STORE.types["geometry_msgs/msg/Vector3"]
STILL = STORE.types["geometry_msgs/msg/Quaternion"](x=0.0, y=0.0, z=0.0, w=1.0)


def twist(x: float) -> Any:
    return message(
        "geometry_msgs/msg/Twist",
        linear=VECTOR(x=x, y=0.0, z=0.0),
        angular=VECTOR(x=0.0, y=0.0, z=0.1 * abs(x)),
    )


def frames(time: float, **places: float) -> Any:
    """A tree of frames with the place of each along x [m]."""
    made = [
        message(
            "geometry_msgs/msg/TransformStamped", time, child_frame_id=name,
            transform=STORE.types["geometry_msgs/msg/Transform"](VECTOR(x=x, y=0.0, z=0.0), STILL),
        )
        for name, x in places.items()
    ]  # fmt: skip
    return message("tf2_msgs/msg/TFMessage", transforms=made)


def odometry(time: float, x: float, v: float) -> Any:
    kinds, none = STORE.types, np.zeros(36)
    pose = kinds["geometry_msgs/msg/Pose"](kinds["geometry_msgs/msg/Point"](x=x, y=0.0, z=0.0), STILL)
    return message(
        "nav_msgs/msg/Odometry", time, child_frame_id="base",
        pose=kinds["geometry_msgs/msg/PoseWithCovariance"](pose, none),
        twist=kinds["geometry_msgs/msg/TwistWithCovariance"](twist(v), none),
    )  # fmt: skip


COMMANDS = [(t, twist(u)) for t, u in zip(TIME, COMMAND)]


def test_a_frame_is_proposed_by_its_name_where_several_nodes_tell_frames(tmp_path):
    told = [
        pair for t, x in zip(TIME, PLACE)
        for pair in ((t + 0.004, frames(t, arm=0.03, hand=0.0)), (t + 0.006, frames(t, base=x)))
    ]  # fmt: skip
    bag = write(tmp_path / "bag", {"/cmd_vel": COMMANDS, "/tf": told})
    output = "/tf transforms[base].transform.translation.x"
    assert roles_of(bag) == {"output": output, "input": "/cmd_vel linear.x"}
    found = guess(bag)
    assert (found.roles.output_kind, found.roles.input_kind) == ("position", "reference")
    record = read_record(bag, Signals.from_text(found.signals))
    np.testing.assert_allclose(record.output.value, PLACE)


def test_odometry_is_proposed_where_nothing_else_is_measured(tmp_path):
    told = [(t + 0.004, odometry(t, x, v)) for t, x, v in zip(TIME, PLACE, SPEED)]
    bag = write(tmp_path / "bag", {"/cmd_vel": COMMANDS, "/odom": told})
    found = roles_of(bag)
    assert found == {
        "output": "/odom pose.pose.position.x", "velocity": "/odom twist.twist.linear.x", "input": "/cmd_vel linear.x",
    }  # fmt: skip


def test_commands_alone_are_refused_and_none_is_proposed_for_the_output(tmp_path):
    bag = write(tmp_path / "bag", {"/cmd_vel": COMMANDS})
    with pytest.raises(InputError, match="all of it was asked for") as refused:
        guess(bag)
    assert "output: {" not in str(refused.value)


@pytest.mark.parametrize("direct", [True, False])
def test_an_entry_that_bears_its_name_is_read_by_it(tmp_path: Path, direct: bool):
    from rhythmid.record.bag import Bag
    from rhythmid.record.columns import read_columns
    from rhythmid.record.field import Field

    rows = [
        (t, frames(t, base=x, arm=0.1) if number % 2 else frames(t, arm=0.2, base=x))
        for number, (t, x) in enumerate(zip(TIME, PLACE))
    ]
    field = Field.parse("transforms[base].transform.translation.x")
    read = read_columns(Bag(write(tmp_path / "bag", {"/tf": rows})).blocks(), {"/tf": [field]}, direct)
    np.testing.assert_allclose(read["/tf"].values[field], PLACE)


def test_a_bag_of_which_only_a_frame_moves_is_read(tmp_path):
    told = [(t, frames(t, base=x)) for t, x in zip(TIME, PLACE)]
    bag = write(tmp_path / "bag", {"/cmd_vel": [(t, twist(0.0)) for t in TIME], "/tf": told})
    assert roles_of(bag)["output"] == "/tf transforms[base].transform.translation.x"


def test_constants_of_a_messages_type_are_no_numbers(tmp_path):
    transition = STORE.types["lifecycle_msgs/msg/Transition"](id=3, label="activate")
    odd = [(TIME[0], message("lifecycle_msgs/msg/TransitionEvent", timestamp=0, transition=transition,
                             start_state=STORE.types["lifecycle_msgs/msg/State"](id=1, label=""),
                             goal_state=STORE.types["lifecycle_msgs/msg/State"](id=3, label="")))]  # fmt: skip
    told = [(t + 0.004, odometry(t, x, v)) for t, x, v in zip(TIME, PLACE, SPEED)]
    bag = write(tmp_path / "bag", {"/cmd_vel": COMMANDS, "/odom": told, "/event": odd})
    assert roles_of(bag)["input"] == "/cmd_vel linear.x"


def test_stamps_that_are_all_zero_are_told_and_no_lateness_is_made_of_them(tmp_path):
    rows = [(1.7e9 + 0.04 * k, joint_state(0.0, ["knee"], position=[np.sin(0.1 * k)])) for k in range(100)]
    report = quality_report(write(tmp_path / "bag", {"/asked": rows}))
    assert any("/asked: its stamps are all zero" in line for line in report.lines())
    assert not any("after the stamp" in line or " duplicates, received" in line for line in report.lines())
    (topic,) = report.topics
    assert topic.to_dict()["clock"] == "receive" and topic.received.rate == pytest.approx(25.0, rel=0.01)
