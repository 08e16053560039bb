"""What MJCF cannot express, applied in a loop of the user's own around MuJoCo's step."""

from pathlib import Path

import mujoco
import numpy as np
import pytest
from legged import MODELS

import rhythmid
from rhythmid.body.machine import Machine
from rhythmid.body.simulate import simulate
from rhythmid.body.write_back import save_machine
from rhythmid.elements.catalogue import load_catalogue
from rhythmid.errors import InputError
from rhythmid.simulation.signal import zero_order_hold

STEPS = 1200


def leg() -> Machine:
    """The leg with what MJCF has no words for: a lag and a dead time inside the loop, a friction with a state, a sensor's gain."""
    known = load_catalogue()
    machine = Machine.load(MODELS / "leg.yaml").with_inertial({"shank.mass": 0.3, "knee.armature": 0.009})
    machine = machine.with_values({"knee.input_delay.delay": 0.0031, "knee.viscous_damper.damping": 0.07})
    for joint, name, values in (
        ("hip", "actuator_lag", {"time_constant": 0.005}),
        ("hip", "lugre_friction", {"force": 0.2, "presliding": 0.01}),
        ("hip", "sensor_gain", {"gain": 1.03}),
        ("knee", "coulomb_friction", {"force": 0.3, "transition": 0.02}),
        ("knee", "actuator_delay", {"delay": 0.0042}),
    ):
        machine = machine.with_element(joint, known[name], values)
    return machine


def plain_leg() -> Machine:
    """The leg with a sensor that can be late; one structure for all tests that need no more."""
    machine = Machine.load(MODELS / "leg.yaml")
    return machine.with_element("knee", load_catalogue()["measurement_delay"], {"delay": 0.0})


def in_the_air(folder: Path, machine: Machine) -> tuple:
    """The written file's model and data, at the machine's own step, and the commands (n, 2)."""
    save_machine(machine, folder / "leg.xml")
    model = mujoco.MjModel.from_xml_path(str(folder / "leg.xml"))
    model.opt.timestep = machine.body.step
    wave = 0.35 * np.sin(2.0 * np.pi * 1.8 * machine.body.step * np.arange(STEPS))
    return model, mujoco.MjData(model), np.column_stack([0.6 + wave, -1.2 - 2.0 * wave])


def loop(model, data, asked: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """True positions and what the sensors say in the user's own loop, from the key frame."""
    mujoco.mj_resetDataKeyframe(model, data, 0)
    true, seen = np.empty(asked.shape), np.empty(asked.shape)
    for k, command in enumerate(asked):
        data.ctrl[:] = command
        true[k] = data.qpos[1:]
        seen[k] = rhythmid.mujoco.apply(model, data)
        mujoco.mj_step(model, data)
    return true, seen


def test_a_loop_with_the_elements_applied_runs_as_simulate_does_and_a_reset_begins_anew(tmp_path: Path):
    machine = leg()
    model, data, asked = in_the_air(tmp_path, machine)
    time = machine.body.step * np.arange(STEPS)
    knots = np.append(-1.0, time)
    command = {
        joint: zero_order_hold(knots, np.append(column[0], column))
        for joint, column in zip(machine.joints, asked.T)
    }
    run = simulate(machine, time, command)
    for _ in range(2):
        true, seen = loop(model, data, asked)
        np.testing.assert_allclose(true, run.position, atol=1e-9)
        np.testing.assert_allclose(seen, run.output, atol=1e-9)


def test_a_copy_of_the_data_goes_on_as_the_original_does(tmp_path: Path):
    model, data, asked = in_the_air(tmp_path, leg())
    loop(model, data, asked[:50])
    other = mujoco.MjData(model)
    mujoco.mj_copyData(other, model, data)
    for command in asked[50:100]:
        for one in (data, other):
            one.ctrl[:] = command
            rhythmid.mujoco.apply(model, one)
            mujoco.mj_step(model, one)
    np.testing.assert_array_equal(data.qpos, other.qpos)


def test_a_measurement_delay_is_part_of_what_is_told(tmp_path: Path):
    machine = plain_leg().with_values({"knee.measurement_delay.delay": 0.002})
    model, data, asked = in_the_air(tmp_path, machine)
    true, seen = loop(model, data, asked[:200])
    late = round(0.002 / machine.body.step)
    np.testing.assert_allclose(seen[late:, 1], true[:-late, 1], atol=1e-12)
    np.testing.assert_array_equal(seen[:, 0], true[:, 0])


def test_the_file_alone_has_the_controllers_delay_and_losses_as_near_as_mjcf_says_them(tmp_path: Path):
    machine = plain_leg().with_values({"knee.input_delay.delay": 0.002})
    model, data, asked = in_the_air(tmp_path, machine)
    whole, _ = loop(model, data, asked)
    plain = mujoco.MjModel.from_xml_path(str(tmp_path / "leg.xml"))
    plain.opt.timestep = machine.body.step
    data = mujoco.MjData(plain)
    mujoco.mj_resetDataKeyframe(plain, data, 0)
    for k, command in enumerate(asked[:600]):
        if k > 150:  # until then it feels that MuJoCo's delay begins with commands of 0
            np.testing.assert_allclose(data.qpos[1:], whole[k], atol=0.005)
        data.ctrl[:] = command
        mujoco.mj_step(plain, data)


def test_actuators_of_the_users_file_keep_their_places_and_take_the_paths_commands(tmp_path: Path):
    text = (MODELS / "leg.xml").read_text()
    own = '<actuator><motor name="lift" joint="knee" gear="3"/><velocity joint="knee" kv="2"/><position joint="hip" kp="5"/></actuator>'
    (tmp_path / "leg.xml").write_text(text.replace("<keyframe>", own + "<keyframe>"))
    (tmp_path / "leg.yaml").write_text((MODELS / "leg.yaml").read_text())
    machine = Machine.load(tmp_path / "leg.yaml").with_path("knee", plain_leg().paths["knee"])
    folder = tmp_path / "out"
    folder.mkdir()
    model, data, _ = in_the_air(folder, machine)
    assert model.nu == 3 and model.actuator(0).name == "lift"
    run = simulate(machine, np.arange(200) * machine.body.step)
    for k in range(200):
        if k == 0:
            mujoco.mj_resetDataKeyframe(model, data, 0)
        np.testing.assert_allclose(data.qpos[1:], run.position[k], atol=1e-9)
        rhythmid.mujoco.apply(model, data)
        mujoco.mj_step(model, data)


def test_a_file_without_paths_or_with_too_little_room_is_told_in_one_line(tmp_path: Path):
    model = mujoco.MjModel.from_xml_path(str(MODELS / "leg.xml"))
    with pytest.raises(
        InputError,
        match="rhythmid export .* of a machine with `joints:`; that of a one-axis model runs without apply",
    ):
        rhythmid.mujoco.apply(model, mujoco.MjData(model))
    model, data, _ = in_the_air(tmp_path, leg())
    model.opt.timestep = 1e-5
    with pytest.raises(InputError, match="nuserdata="):
        rhythmid.mujoco.apply(model, data)
