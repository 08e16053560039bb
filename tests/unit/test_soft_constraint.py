"""Dry friction as a soft constraint: MuJoCo's own law at its steps, in the simulator, along a motion, and in a diagnosis of joints."""

from pathlib import Path

import mujoco
import numpy as np
import pytest

from rhythmid.body.machine import Machine
from rhythmid.body.simulate import simulate as simulate_machine
from rhythmid.body.write_back import save_machine
from rhythmid.diagnose.effort.candidate import Start, extended
from rhythmid.diagnose.joints.joint_diagnosis import diagnose_machine
from rhythmid.elements.catalogue import load_catalogue
from rhythmid.errors import InputError
from rhythmid.model import Model
from rhythmid.record.joint_record import JointRecord
from rhythmid.record.record import Channel, Record
from rhythmid.simulation.effect import Path as Trajectory
from rhythmid.simulation.effect import effect_along
from rhythmid.simulation.generated_source import generate
from rhythmid.simulation.right_hand_side import Variant
from rhythmid.simulation.signal import zero_order_hold
from rhythmid.simulation.simulate import simulate

STEP, INERTIA, FRICTION = 2e-4, 3e-3, 0.05  # s, kg*m^2, N*m
HINGE = f"""<mujoco><compiler autolimits="true"/><option timestep="{STEP}" gravity="0 0 0"/><worldbody><body name="link">
<joint name="hinge" axis="0 1 0" {{friction}}/><inertial pos="0 0 0" mass="1" diaginertia="{INERTIA} {INERTIA} {INERTIA}"/>
</body></worldbody></mujoco>"""
LEAD = 0.0095  # s, with MuJoCo's defaults
ARM = """<mujoco><worldbody><body name="upper"><joint name="shoulder" axis="0 1 0" armature="0.004" damping="0.05"/>
<inertial pos="0 0 -0.15" mass="1.2" diaginertia="0.01 0.01 0.002"/><body name="lower" pos="0 0 -0.3">
<joint name="elbow" axis="0 1 0" armature="2e-4" damping="0.005"/><inertial pos="0 0 -0.03" mass="0.08" diaginertia="1e-4 1e-4 2e-5"/>
</body></body></worldbody></mujoco>"""


def torque(time: np.ndarray) -> np.ndarray:
    """A torque that reverses the hinge, and comes to rest within the friction."""
    return (0.1 * np.sin(8.0 * time) + 0.04 * np.sin(27.0 * time)) * (time < 1.5) + 0.02 * (time >= 1.5)


def hinge() -> tuple[dict[str, float], dict[str, np.ndarray]]:
    """The law's values that belong to MuJoCo's frictionloss of this hinge, and its motion under the torque."""
    model = mujoco.MjModel.from_xml_string(HINGE.format(friction=f'frictionloss="{FRICTION}"'))
    data = mujoco.MjData(model)
    time = STEP * np.arange(10000)
    rows = np.empty((len(time), 4))
    for k, asked in enumerate(torque(time)):
        data.qfrc_applied[0], before = asked, (float(data.qpos[0]), float(data.qvel[0]))
        mujoco.mj_step(model, data)
        rows[k] = *before, data.qacc[0], data.qfrc_constraint[0]
    impedance, weight = float(model.dof_solimp[0, 0]), float(model.dof_invweight0[0])
    values = {
        "force": FRICTION,
        "softness": INERTIA * weight * (1.0 - impedance) / impedance,
        "lead": LEAD,
    }
    return values, {"time": time, **dict(zip(("x", "v", "a", "force"), rows.T))}


def soft(values: dict[str, float], mass: float = INERTIA) -> Model:
    model = Model.from_text(f"inertia: {{mass: {{value: {mass}, unit: kg*m^2}}}}\n")
    return model.with_element(load_catalogue()["soft_constraint_friction"], values)


def test_the_law_is_the_frictionloss_of_mujoco_at_every_step(catalogue):
    values, run = hinge()
    kernel = catalogue["soft_constraint_friction"].kernel
    free = torque(run["time"]) / INERTIA
    given = [
        kernel(a, 1.0 / INERTIA, 0.0, v, 0.0, 0.0, **values, mass=INERTIA) for a, v in zip(free, run["v"])
    ]
    np.testing.assert_allclose(given, run["force"], atol=1e-12)
    assert 0.02 < np.mean(np.abs(run["force"]) < 0.99 * FRICTION) < 0.5  # it slides, turns and creeps


def test_along_a_measured_motion_the_law_gives_the_force_that_made_it(catalogue):
    values, run = hinge()
    flat = np.zeros(len(run["time"]))
    path = Trajectory(run["time"], run["x"], run["v"], flat, flat, flat, acceleration=run["a"])
    force = effect_along(catalogue["soft_constraint_friction"], values, soft(values), path)
    np.testing.assert_allclose(force, run["force"], atol=1e-12)


def test_the_simulator_moves_as_mujoco_does():
    values, run = hinge()
    found = simulate(soft(values), run["time"], zero_order_hold(run["time"], torque(run["time"])))
    np.testing.assert_allclose(found.position, run["x"], atol=2e-3 * np.ptp(run["x"]))
    sticking = soft(values | {"lead": 1e-6, "softness": 0.01})
    other = simulate(sticking, run["time"], zero_order_hold(run["time"], torque(run["time"])))
    assert np.abs(other.position - run["x"]).max() > 0.02 * np.ptp(run["x"])  # the lead is seen


def test_coulomb_friction_is_the_law_without_lead_and_creep(catalogue):
    law, coulomb = (catalogue[name].kernel for name in ("soft_constraint_friction", "coulomb_friction"))
    for v in (-0.3, -0.01, 0.02):
        for acceleration in (-5.0, 3.0):
            here = law(acceleration, 2.0, 0.0, v, 0.0, 0.0, 0.4, 0.1, 1e-7, 1.0)
            assert here == pytest.approx(coulomb(0.0, v, 0.0, 0.0, 0.4, 1e-6, 1.0, 1e-9))


def machine_of(folder: Path, xml: str, joints: str) -> Machine:
    (folder / "body.xml").write_text(xml)
    (folder / "machine.yaml").write_text(f"body: {{mjcf: body.xml}}\njoints: {joints}\n")
    return Machine.load(folder / "machine.yaml")


def test_a_body_that_mujoco_steps_has_the_law_and_writes_it_back(tmp_path: Path):
    values, run = hinge()
    values |= {"softness": 1.5 * values["softness"], "lead": 0.02}  # not what MuJoCo does by default
    command = zero_order_hold(run["time"], torque(run["time"]))
    machine = machine_of(tmp_path, HINGE.format(friction=""), "{hinge: {}}")
    machine = machine.with_element("hinge", load_catalogue()["soft_constraint_friction"], values)
    alone = simulate(soft(values), run["time"], command).position
    found = simulate_machine(machine, run["time"], {"hinge": command}).position[:, 0]
    np.testing.assert_allclose(found, alone, atol=2e-3 * np.ptp(alone))
    assert save_machine(machine, tmp_path / "better.xml") == ()
    model = mujoco.MjModel.from_xml_path(str(tmp_path / "better.xml"))
    data, again = mujoco.MjData(model), np.empty(len(alone))
    for k, asked in enumerate(torque(run["time"])):
        again[k], data.qfrc_applied[0] = data.qpos[0], asked
        mujoco.mj_step(model, data)
    np.testing.assert_allclose(again, found, atol=1e-6 * np.ptp(alone))


def test_a_base_whose_acceleration_is_unknown_is_refused():
    values, _ = hinge()
    with pytest.raises(InputError, match="acceleration relative to the base"):
        generate(soft(values).terms, Variant(excited="base_displacement"))


def logged(model: mujoco.MjModel, rng: np.random.Generator) -> JointRecord:
    """An arm's log at 500 Hz under its controllers, which know its weight; noise of encoders and 1 % of noise on efforts."""
    data, inertia, whole = mujoco.MjData(model), np.array([0.06, 5e-4]), []
    time = 1e-3 * np.arange(10000)
    lines, phases = np.arange(1, 22)[:, None] / 10.0, rng.uniform(0.0, 2.0 * np.pi, (2, 21, 1))
    asked = 0.12 * np.sum(np.cos(2.0 * np.pi * lines * time + phases) / np.maximum(lines, 0.7), axis=1).T
    model.opt.timestep = 1e-3
    for wanted in asked * np.minimum(1.0, time)[:, None]:
        effort = inertia * (355.0 * (wanted - data.qpos) - 34.0 * data.qvel) + data.qfrc_bias
        whole.append([*data.qpos, *effort])
        data.qfrc_applied[:] = effort
        mujoco.mj_step(model, data)
    rows = np.array(whole)
    rows[1:, 2:] = 0.5 * (rows[1:, 2:] + rows[:-1, 2:])  # of the two steps in a sample
    rows, stamps = rows[::2], time[::2]
    rows[:, :2] += 2e-5 * rng.standard_normal((len(rows), 2))
    rows[:, 2:] += 0.01 * rows[:, 2:].std(axis=0) * rng.standard_normal((len(rows), 2))
    return JointRecord(
        "run",
        {
            joint: Record(
                "run", Channel(stamps, rows[:, k], "rad"), effort=Channel(stamps, rows[:, 2 + k], "N*m")
            )
            for k, joint in enumerate(("shoulder", "elbow"))
        },
        None,
    )


@pytest.mark.parametrize("friction", [0.0, 0.004])
def test_a_concealed_frictionloss_in_a_light_joint_is_named_and_nothing_where_there_is_none(
    tmp_path: Path, friction: float
):
    machine = machine_of(tmp_path, ARM, "{shoulder: {}, elbow: {}}")
    model = mujoco.MjModel.from_xml_string(ARM)
    model.dof_frictionloss[1] = friction
    records = [logged(model, np.random.default_rng(seed)) for seed in (1, 2)]
    found = diagnose_machine(records, machine).diagnosis
    named = [(one.joint, one.element) for one in found.missing]
    assert named == ([("elbow", "soft_constraint_friction")] if friction else [])
    if friction:
        assert found.missing[0].parameters["force"].value == pytest.approx(friction, rel=0.1)
        assert found.missing[0].parameters["lead"].value == pytest.approx(LEAD, abs=0.004)


def test_as_a_candidate_it_takes_the_place_of_the_coulomb_friction_that_it_contains(catalogue):
    model = soft({"force": 0.1}).without("soft_constraint_friction")
    model = model.with_element(catalogue["coulomb_friction"], {"force": 0.3})
    start = Start(
        "effects", "soft_constraint_friction", catalogue["soft_constraint_friction"], {"force": 0.2}
    )
    found, label = extended(model, start)
    assert label == "soft_constraint_friction" and found.value("soft_constraint_friction.force") == 0.2
    assert found.value("coulomb_friction.force") == 0.0 and "coulomb_friction.force" not in found.free
