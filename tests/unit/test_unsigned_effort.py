"""An effort without its sign is told from one that holds a weight, and is not taken for the effort."""

from pathlib import Path

import numpy as np
import pytest
from legged import TWO_LINKS

from rhythmid.body.machine import Machine
from rhythmid.diagnose.admission import admitted
from rhythmid.diagnose.joints.joint_diagnosis import diagnose_machine
from rhythmid.elements.catalogue import load_catalogue
from rhythmid.errors import InputError
from rhythmid.model import Model
from rhythmid.record.bag_report import quality_report
from rhythmid.record.joint_record import JointSignals, load_joint_records
from rhythmid.record.read import read_record
from rhythmid.record.signals import Signals
from rhythmid.record.unsigned import WHY, is_unsigned, unsigned_joints
from rhythmid.start.robot import start_robot
from rhythmid.start.start import guess

TIME = 0.05 * np.arange(3000)
POSITION = np.sin(0.8 * TIME) + 0.4 * np.sin(1.9 * TIME)
SPEED = np.gradient(POSITION, TIME)
ACCELERATION = np.gradient(SPEED, TIME)
NOISE = np.random.default_rng(1).standard_normal(len(TIME))
FORCE = 0.3 * ACCELERATION + 0.2 * SPEED + 0.2 * np.tanh(SPEED / 0.05) + 0.02 * NOISE
COARSE = 0.02 * np.round(POSITION / 0.02)


def test_the_size_of_a_force_is_unsigned() -> None:
    assert is_unsigned(TIME, COARSE, 0.01 + np.abs(FORCE))
    assert is_unsigned(TIME, COARSE, -np.abs(FORCE))


@pytest.mark.parametrize(
    "weight",
    [2.0 + 0.0 * POSITION, 3.0 * np.cos(0.5 * POSITION), 3.0 + POSITION],
    ids=["held", "arm", "spring"],
)
def test_a_force_that_holds_a_weight_has_its_sign(weight: np.ndarray) -> None:
    force = weight + FORCE
    assert force.min() > 0.0 and not is_unsigned(TIME, COARSE, force)


def test_a_force_that_changes_its_sign_or_goes_with_no_motion_is_none() -> None:
    assert not is_unsigned(TIME, COARSE, FORCE)
    assert not is_unsigned(TIME, COARSE, np.abs(NOISE))


def test_a_contact_that_pushes_only_has_its_sign() -> None:
    force = np.maximum(-5.0 * POSITION - 0.5 * SPEED, 0.0) + 0.02 * np.abs(NOISE)
    assert not is_unsigned(TIME, COARSE, force)


def test_a_motion_that_goes_one_way_tells_nothing_of_the_sign() -> None:
    assert not is_unsigned(TIME, TIME + 0.1 * np.sin(TIME), np.abs(FORCE))


def test_init_says_that_a_current_has_no_sign_and_does_not_take_it(tmp_path: Path) -> None:
    command = np.interp(TIME + 0.1, TIME, POSITION)
    path = tmp_path / "run.csv"
    columns = np.column_stack([TIME, command, COARSE, 500.0 * np.abs(FORCE)])
    heading = "t,command_angle,feedback_angle,current_mA"
    np.savetxt(path, columns, delimiter=",", header=heading, comments="", fmt="%.5g")
    found = guess(path)
    assert set(found.roles.choices) == {"output", "input"} and found.roles.input_kind == "reference"
    (said,) = [line for line in found.lines() if "never changes its sign" in line]
    assert said.startswith("CHECK current_mA is not used: ")
    signals = tmp_path / "signals.yaml"
    channels = (
        "output: {column: feedback_angle, unit: rad}\neffort: {column: current_mA, unit: A}\ninput: none\n"
    )
    signals.write_text("time: {column: t}\n" + channels)
    notes = quality_report(path, signals).notes
    assert [note for note in notes if note.startswith("effort: it is no effort as it was recorded")]


def test_the_size_of_a_controllers_error_is_unsigned_and_what_holds_a_weight_is_not() -> None:
    command = np.interp(TIME + 0.1, TIME, POSITION)
    steps = command + 0.3 * np.sign(np.sin(0.31 * TIME))  # an error that the motion alone does not tell
    size = np.abs(steps - COARSE) + 0.01 * np.abs(NOISE)
    assert is_unsigned(TIME, COARSE, size, steps)
    assert not is_unsigned(TIME, COARSE, 3.0 + steps - COARSE, steps)


@pytest.fixture
def arm(tmp_path: Path) -> Path:
    """A folder with the table of two joints whose efforts are the sizes of their controllers' errors."""
    (tmp_path / "two.urdf").write_text(TWO_LINKS)
    other = np.sin(0.9 * TIME + 1.0) + 0.4 * np.sin(1.7 * TIME)
    columns, heading = [TIME], ["time"]
    for joint, position in (("one", POSITION), ("two", other)):
        command = np.interp(TIME + 0.1, TIME, position)
        columns += [position, command, 5.0 * np.abs(command - position)]
        heading += [f"{joint}_{what}" for what in ("pos", "cmd", "torque")]
    path = tmp_path / "run.csv"
    np.savetxt(
        path, np.column_stack(columns), delimiter=",", header=",".join(heading), comments="", fmt="%.6g"
    )
    return path


def test_init_of_a_robot_does_not_take_efforts_without_signs(arm: Path) -> None:
    found = start_robot([arm], arm.parent / "two.urdf", arm.parent, None, load_catalogue())
    assert "effort:" not in found.signals.replace("# ", "") and "kind: reference" in found.signals
    (said,) = [line for line in found.lines() if WHY in line]
    assert said.startswith("CHECK *_torque is not used, at one, two: ")


def test_check_and_diagnose_of_a_robot_say_in_the_same_words_that_efforts_have_no_signs(arm: Path) -> None:
    signals = arm.parent / "signals.yaml"
    signals.write_text(
        'joints: [one, two]\ntime: {column: time}\noutput: {column: "*_pos"}\n'
        'input: {column: "*_cmd", kind: reference}\neffort: {column: "*_torque"}\n'
    )
    model = arm.parent / "model.yaml"
    path = "{force: [{viscous_damper: {damping: 0.1}}]}"
    model.write_text(f"body: {{urdf: two.urdf, contacts: false}}\njoints:\n  one: {path}\n  two: {path}\n")
    said = f"effort: {WHY}"
    records = load_joint_records([arm], JointSignals.load(signals))
    assert unsigned_joints(records) == {"one": said, "two": said}
    assert f"one, two: {said}" in quality_report(arm, signals).notes
    with pytest.raises(InputError, match=f"no joint can be judged: one, two: {said}"):
        diagnose_machine(records, Machine.load(model))


SIGN = np.tanh(SPEED / 0.05)
DUTY = 20.0 * SPEED + 3.0 * SIGN + 0.3 * NOISE  # of a motor with friction, whose direction is another signal


def test_the_size_of_a_duty_beside_a_speed_is_unsigned_and_one_about_a_middle_is_not() -> None:
    assert is_unsigned(TIME, SPEED, np.abs(DUTY), is_speed=True)
    assert not is_unsigned(TIME, SPEED, DUTY, is_speed=True)
    assert not is_unsigned(TIME, SPEED, 127.0 + DUTY, is_speed=True)


def test_init_check_and_diagnose_say_that_a_duty_beside_a_speed_has_no_sign(tmp_path: Path) -> None:
    path = tmp_path / "run.csv"
    columns = np.column_stack([TIME, SPEED, np.abs(DUTY)])
    np.savetxt(path, columns, delimiter=",", header="t,speed [rad/s],pwm", comments="", fmt="%.6g")
    found = guess(path)
    (said,) = [line for line in found.lines() if WHY in line]
    assert said == f"CHECK input: {WHY}"
    signals = tmp_path / "signals.yaml"
    signals.write_text(found.signals)
    assert f"input: {WHY}" in quality_report(path, signals).notes
    model = Model.from_text(
        "units: {force: '1', position: rad}\ninertia: {mass: 1.0}\nforce: [viscous_damper: {damping: 20.0}]"
    )
    assert f"run: input: {WHY}" in admitted([read_record(path, Signals.load(signals))], [], model).notes
