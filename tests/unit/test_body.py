"""A machine of several joints: MuJoCo moves the body, elements act along its joints."""

from dataclasses import replace
from importlib.resources import files
from pathlib import Path

import mujoco
import numpy as np
import pytest

from rhythmid.body.machine import Machine, describes_machine
from rhythmid.body.mujoco_body import MujocoBody
from rhythmid.body.simulate import means, run_steps, simulate
from rhythmid.body.write_back import save_machine
from rhythmid.elements.catalogue import load_catalogue
from rhythmid.errors import InputError
from rhythmid.model import Model
from rhythmid.simulation.signal import spline, zero_order_hold
from rhythmid.simulation.simulate import simulate as simulate_one_axis

MODELS = Path(str(files("rhythmid"))) / "models"
LEG = MODELS / "legs" / "leg.yaml"


def written(folder: Path, text: str) -> Path:
    """A machine's file beside the leg's body."""
    path = folder / "machine.yaml"
    path.write_text(text.replace("leg.xml", str(MODELS / "legs" / "leg.xml")))
    return path


def test_the_papers_hopper_as_mjcf_runs_as_the_built_in_body_does():
    time = np.arange(10001) * 1e-3
    forcing = spline(time, np.cos(2.0 * np.pi * time))
    command = zero_order_hold(time, 0.3 * np.sin(2.0 * np.pi * 3.0 * time))
    usual = simulate_one_axis(Model.load(MODELS / "paper_hopper.yaml"), time, command, forcing, (0.15, 0.0))
    machine = Machine.load(MODELS / "legs" / "hopper.yaml")
    found = simulate(machine, time, {"leg": command}, {"leg": forcing})
    assert np.abs(found.output[:, 0] - usual.output).max() < 1e-5


def test_a_damper_agrees_with_mujocos_own_and_is_stable_however_strong():
    machine = Machine.load(LEG)
    machine = replace(machine, body=MujocoBody.load(machine.body.path, "rail", 0.001, contacts=False))
    for damping in (0.05, 30.0):  # the second is far beyond what an explicit step bears
        made = machine.with_values(
            {"knee.viscous_damper.damping": damping, "hip.viscous_damper.damping": damping}
        )
        _, rows = run_steps(made, 0.0, 400)
        model, data = made.body.worker()
        model.dof_damping[1:] = damping
        data.qpos[:] = made.body.reference
        for k in range(400):
            for place, pose in ((1, 0.0), (2, 0.0)):  # no command: the controllers hold the joints at 0
                data.qfrc_applied[place] = 60.0 * (pose - data.qpos[place]) - 1.2 * data.qvel[place]
            np.testing.assert_allclose(rows[k, -6:-3], data.qpos, atol=1e-9)
            mujoco.mj_step(model, data)


def test_inverse_dynamics_gives_back_what_moved_the_body():
    body = MujocoBody.load(MODELS / "legs" / "leg.xml", "rail", contacts=False)
    rng = np.random.default_rng(3)
    pose, rate, acceleration = (rng.normal(size=(20, 3)) for _ in range(3))
    force = body.inverse(pose, rate, acceleration)
    model, data = body.worker()
    model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_LIMIT)
    for k in range(20):
        data.qpos[:], data.qvel[:], data.qfrc_applied[:] = pose[k], rate[k], force[k]
        mujoco.mj_forward(model, data)
        np.testing.assert_allclose(data.qacc, acceleration[k], rtol=1e-8, atol=1e-8)


def test_inverse_dynamics_is_linear_in_the_inertial_parameters_of_every_link():
    body = MujocoBody.load(MODELS / "legs" / "leg.xml", "rail", contacts=False)
    rng = np.random.default_rng(4)
    motion = [rng.normal(size=(30, 3)) for _ in range(3)]
    whole = sum(body.inertial_columns(link, *motion) @ body.inertial(link) for link in body.links)
    armature = np.array([0.0, 0.006, 0.006])
    np.testing.assert_allclose(whole + armature * motion[2], body.inverse(*motion), atol=1e-10)
    heavier = body.with_parameters({"shank.mass": 0.3, "knee.armature": 0.01})
    columns = body.columns(["shank.mass", "knee.armature"], *motion)
    expected = body.inverse(*motion) + columns @ np.array([0.3 - 0.22, 0.004])
    np.testing.assert_allclose(heavier.inverse(*motion), expected, atol=1e-10)


def test_elements_with_states_pasts_and_memories_act_along_a_joint():
    catalogue, machine = load_catalogue(), Machine.load(LEG)
    machine = replace(machine, body=MujocoBody.load(machine.body.path, "rail", 0.001, contacts=False))
    time = np.arange(0.0, 1.0, 0.001)
    command = {"knee": spline(time, -1.2 + 0.3 * np.sin(9.0 * time)), "hip": spline(time, 0.6 + 0.0 * time)}
    usual = simulate(machine, time, command)
    values = {
        "actuator_lag": {"time_constant": 0.004},
        "actuator_delay": {"delay": 0.004},
        "backlash": {"width": 0.5},
        "sensor_lag": {"time_constant": 0.02},
    }
    for name, size in values.items():
        found = simulate(machine.with_element("knee", catalogue[name], size), time, command)
        assert 1e-4 < np.abs(found.output - usual.output)[:, 1].max() < 1.0, name
        if name == "sensor_lag":
            np.testing.assert_allclose(found.position, usual.position, atol=1e-9)


def test_the_mean_of_a_held_command_keeps_its_impulse():
    signal = zero_order_hold(np.array([0.0, 0.15, 0.4]), np.array([1.0, -2.0, 3.0]))
    np.testing.assert_allclose(means(signal, -0.1, 0.1, 7), [0.0, 1.0, -0.5, -2.0, -2.0, 3.0, 3.0])


def test_a_machine_is_read_back_as_it_was_written(tmp_path: Path):
    machine = Machine.load(LEG).with_inertial({"shank.mass": 0.25})
    machine = machine.with_element("hip", load_catalogue()["coulomb_friction"], {"force": 0.1})
    machine.save(tmp_path / "saved.yaml")
    again = Machine.load(tmp_path / "saved.yaml")
    assert again.to_yaml(tmp_path) == machine.to_yaml(tmp_path)
    assert again.body.parameters["shank.mass"] == pytest.approx(0.25)
    assert again.paths["hip"].mass.value == pytest.approx(machine.paths["hip"].mass.value)
    assert describes_machine(LEG) and not describes_machine(MODELS / "paper_hopper.yaml")


def test_a_base_on_a_wall_feels_gravity_along_another_axis_in_balance_run_and_file(tmp_path: Path):
    usual = Machine.load(LEG)
    text = usual.to_yaml(tmp_path).replace("contacts:", "gravity: [9.81, 0, -1], contacts:", 1)
    (tmp_path / "wall.yaml").write_text(text)
    machine = Machine.load(tmp_path / "wall.yaml")
    assert Machine.from_text(machine.to_yaml(tmp_path), tmp_path, load_catalogue()).body.gravity.tolist() == [9.81, 0.0, -1.0]  # fmt: skip
    heavier = machine.with_inertial({"shank.mass": 0.5}).body  # a copy keeps it
    assert heavier.gravity.tolist() == [9.81, 0.0, -1.0] and usual.body.gravity[2] == pytest.approx(-9.81)
    rest = np.zeros((1, 3))
    assert not np.allclose(machine.body.inverse(rest, rest, rest), usual.body.inverse(rest, rest, rest))
    time = np.arange(50) * 0.002
    assert not np.allclose(simulate(machine, time, {}).pose[-1], simulate(usual, time, {}).pose[-1])
    save_machine(machine, tmp_path / "wall.xml")
    written_back = mujoco.MjModel.from_xml_path(str(tmp_path / "wall.xml"))
    assert written_back.opt.gravity.tolist() == [9.81, 0.0, -1.0]


def test_losses_that_the_bodys_file_gives_a_joint_become_elements(tmp_path: Path):
    xml = (MODELS / "legs" / "leg.xml").read_text()
    (tmp_path / "lossy.xml").write_text(
        xml.replace('name="knee"', 'name="knee" damping="0.2" frictionloss="0.1"')
    )
    (tmp_path / "m.yaml").write_text("body: {mjcf: lossy.xml, base: rail}\njoints: {knee: {}, hip: {}}\n")
    machine = Machine.load(tmp_path / "m.yaml")
    assert machine.joints == ("hip", "knee")
    assert machine.value("knee.viscous_damper.damping") == 0.2
    assert machine.value("knee.coulomb_friction.force") == 0.1
    assert not machine.paths["hip"].terms


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("joints: {knee: {}}", "'body:' is missing"),
        ("body: {mjcf: none.xml}\njoints: {knee: {}}", "no such file"),
        ("body: {mjcf: leg.xml, base: rails}\njoints: {knee: {}}", "neither fixed, free nor a joint"),
        ("body: {mjcf: leg.xml, base: free}\njoints: {knee: {}}", "no free joint"),
        ("body: {mjcf: leg.xml}\njoints: {ankle: {}}", "no such joint; it has rail, hip, knee"),
        ("body: {mjcf: leg.xml, base: rail}\njoints: {rail: {}}", "joint of the base"),
        ("body: {mjcf: leg.xml, free: {tail.mass: {}}}\njoints: {knee: {}}", "no such parameter"),
        ("body: {mjcf: leg.xml, free: {shank.mass: 0}}\njoints: {knee: {}}", "a mapping"),
        ("body: {mjcf: leg.xml, gravity: [9.81, 0]}\njoints: {knee: {}}", "gravity"),
        ("body: {mjcf: leg.xml, gravity: [9810, 0, 0]}\njoints: {knee: {}}", "too large"),
        ("body: {mjcf: leg.xml, step: 1}\njoints: {knee: {}}", "too large"),
        ("body: {mjcf: leg.xml}\njoints: {knee: {force: [{frictions: {}}]}}", "unknown element"),
    ],
)
def test_what_is_wrong_in_a_machines_file_is_told_in_one_line(tmp_path: Path, text: str, said: str):
    with pytest.raises(InputError, match=said) as caught:
        Machine.load(written(tmp_path, text))
    assert "\n" not in str(caught.value)


def test_a_body_that_mujoco_refuses_or_that_has_no_mass_is_told_in_one_line(tmp_path: Path):
    (tmp_path / "broken.xml").write_text(
        "<mujoco><worldbody><body><joint name='a'/></body></worldbody></mujoco>"
    )
    with pytest.raises(InputError, match="MuJoCo refuses it") as caught:
        MujocoBody.load(tmp_path / "broken.xml")
    assert "\n" not in str(caught.value)
    with pytest.raises(InputError, match="diverges at"):
        machine = Machine.load(LEG)
        model = machine.paths["knee"].with_values({"position_control.proportional": 1e9})
        run_steps(machine.with_path("knee", model), 0.0, 500)
