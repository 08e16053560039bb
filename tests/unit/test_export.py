"""`rhythmid export`: a model in the words of simulators moves there as it does here, and what has no word there is named."""

import ast
import csv
import io
import math
import xml.etree.ElementTree as tree
from dataclasses import replace

import mujoco
import numpy as np
import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as some
from scipy.signal import lsim

from rhythmid.elements.catalogue import load_catalogue
from rhythmid.errors import InputError
from rhythmid.experiment import Experiment
from rhythmid.export.export import WRITERS, exported
from rhythmid.export.from_model import READERS, joint_of
from rhythmid.export.joint import Joint
from rhythmid.export.link import STANDARD_GRAVITY, link_of
from rhythmid.export.matlab import linear_part
from rhythmid.model import Model
from rhythmid.offline_run import perform

CHIRP = "{type: chirp, amplitude: %s, band: [0.5, 6], sweep: 2.0}"
DRIVEN = """\
inertia: {mass: {value: 0.8, unit: kg}}
command: [{input_delay: {delay: 0.0125}}]
actuator: [{actuator_gain: {gain: 0.9}}, {actuator_lag: {time_constant: 0.008}}]
force:
  - gravity: {acceleration: 3.0}
  - linear_spring: {stiffness: 200.0, rest_length: 0.012}
  - quadratic_stiffness: {coefficient: 400.0}
  - cubic_stiffness: {coefficient: 3000.0}
  - viscous_damper: {damping: 1.0}
  - quadratic_drag: {coefficient: 2.0}
sensor: [{measurement_delay: {delay: 0.006}}]
"""
SERVO = """\
inertia: {mass: {value: 0.05, unit: kg*m^2}}
command: [{input_delay: {delay: 0.02}}, {command_lag: {time_constant: 0.01}}, {position_control: {proportional: 8.0, derivative: 0.3}}]
actuator: [{actuator_gain: {gain: 0.8}}]
force: [{pendulum_gravity: {moment: 0.7, reference: 0.0}}, {viscous_damper: {damping: 0.05}}]
"""
LINEAR = """\
inertia: {mass: {value: 0.8, unit: kg}}
command: [{input_delay: {delay: 0.0125}}]
actuator: [{actuator_gain: {gain: 0.9}}, {actuator_lag: {time_constant: 0.008}}]
force: [{linear_spring: {stiffness: 200.0}}, {viscous_damper: {damping: 1.5}}]
sensor: [{measurement_delay: {delay: 0.006}}]
"""
MOTOR = """\
inertia: {mass: {value: 0.002, unit: kg*m^2}}
command: [{velocity_control: {gain: 2.0}}]
actuator: [{actuator_saturation: {limit: 6.0}}, {dc_motor: {torque_constant: 0.1, resistance: 2.0}}]
"""
DRY = """\
inertia: {mass: {value: 0.8, unit: kg}}
force: [{linear_spring: {stiffness: 200.0}}, {viscous_damper: {damping: 1.0}}, {coulomb_friction: {force: 1.0, transition: 0.005}}]
"""
SOFT = DRY.replace(
    "coulomb_friction: {force: 1.0, transition: 0.005}",
    "soft_constraint_friction: {force: 1.0, softness: 1.0, lead: 0.015}",
)
HANGING = """\
inertia: {mass: {value: 0.5, unit: kg}}
force: [{gravity: {acceleration: 3.0}}, {linear_spring: {stiffness: 50.0, rest_length: 0.03}}, {viscous_damper: {damping: 0.4}}]
"""
PENDULUM = """\
inertia: {mass: {value: 0.02, unit: kg*m^2}}
force: [{pendulum_gravity: {moment: 0.5, reference: 0.2}}, {viscous_damper: {damping: 0.01}}]
"""


def joint(text: str, name: str = "knee") -> Joint:
    return joint_of(Model.from_text(text), name)


def run(folder, text: str, amplitude: float, position: float = 0.0):
    """Command (n,) and true position (n,) of `rhythmid simulate`, at 1 kHz."""
    (folder / "model.yaml").write_text(text, encoding="utf-8")
    experiment = Experiment.from_text(
        f"model: model.yaml\nexcitation: {CHIRP % amplitude}\nforcing: {{amplitude: 0.0}}\n"
        f"initial: {{position: {position}, velocity: 0.0}}\n",
        folder,
    )
    topics = perform(experiment)
    return topics["excitation"].effort, topics["plant/joint_states"].position


def moved(model: mujoco.MjModel, command: np.ndarray, position: float = 0.0):
    """True position (n,) and sensor (n,) of MuJoCo under a command."""
    data = mujoco.MjData(model)
    data.qpos[0] = position
    true, seen = np.empty(len(command)), np.empty(len(command))
    for k, value in enumerate(command):
        true[k] = data.qpos[0]
        if model.nu:
            data.ctrl[0] = value
        mujoco.mj_step(model, data)
        seen[k] = data.sensordata[0] if model.nsensor else math.nan
    return true, seen


def error(found: np.ndarray, expected: np.ndarray) -> float:
    return float(np.sqrt(np.mean((found - expected) ** 2)) / np.std(expected))


def test_mujoco_moves_and_measures_as_rhythmid_simulates(tmp_path):
    command, expected = run(tmp_path, DRIVEN, 8.0)
    found, seen = moved(mujoco.MjModel.from_xml_string(exported([joint(DRIVEN)], "mujoco")), command)
    assert error(found, expected) < 0.003
    time = 1e-3 * np.arange(len(command))
    assert error(seen, np.interp(time - 0.006, time, expected)) < 0.003
    assert error(seen, expected) > 0.05  # the delay is seen


def test_a_servo_in_mujoco_and_in_the_state_space_moves_as_rhythmid_simulates(tmp_path):
    command, expected = run(tmp_path, SERVO, 0.05)
    found, _ = moved(mujoco.MjModel.from_xml_string(exported([joint(SERVO)], "mujoco")), command)
    assert error(found, expected) < 0.003
    part = linear_part(joint(SERVO))
    late = np.concatenate([np.zeros(round(1000 * part.input_delay)), command])[: len(command)]
    system = (part.a, part.b, np.eye(1, len(part.a)), np.zeros((1, 1)))
    _, linear, _ = lsim(system, late, 1e-3 * np.arange(len(command)), interp=False)
    assert error(part.equilibrium + linear, expected) < 0.003


def test_dry_friction_in_mujoco_is_nearly_that_of_rhythmid(tmp_path):
    command, expected = run(tmp_path, DRY, 8.0)
    errors = [
        error(moved(mujoco.MjModel.from_xml_string(exported([one], "mujoco")), command)[0], expected)
        for one in (joint(DRY), replace(joint(DRY), friction=0.0))
    ]
    assert errors[0] < 0.05  # frictionloss is a constraint and no law of the speed
    assert errors[1] > 4.0 * errors[0]


def test_dry_friction_that_is_a_constraint_moves_in_mujoco_as_in_rhythmid_and_is_friction_in_a_urdf(tmp_path):
    command, expected = run(tmp_path, SOFT, 8.0)
    found, _ = moved(mujoco.MjModel.from_xml_string(exported([joint(SOFT)], "mujoco")), command)
    assert error(found, expected) < 0.003
    urdf = exported([joint(SOFT)], "urdf")
    assert 'friction="1.0"' in urdf
    assert "not expressed: friction_regularisation 1.25 1/kg" in urdf
    both = SOFT.replace("force: [", "force: [{coulomb_friction: {force: 0.5}}, ")
    assert "two dry frictions" in exported([joint(both)], "mujoco")


def test_the_urdf_swings_in_mujoco_as_the_mjcf_does():
    runs = []
    for target in ("mujoco", "urdf"):
        model = mujoco.MjModel.from_xml_string(exported([joint(PENDULUM)], target))
        model.opt.integrator, model.opt.timestep = mujoco.mjtIntegrator.mjINT_RK4, 1e-3
        runs.append(moved(model, np.zeros(2000), 1.0)[0])
    np.testing.assert_allclose(runs[1], runs[0], atol=1e-9)
    assert runs[0].min() < 0.0 < runs[0].max()  # it swings about the angle at which it hangs


def test_a_motor_is_a_gain_and_a_damping():
    described = joint(MOTOR)
    assert (described.gain, described.damping) == pytest.approx((0.05, 0.005))
    assert described.effort_limit == pytest.approx(0.3)  # of 6 V
    assert 'forcerange="-0.3 0.3"' in exported([described], "mujoco")


def test_a_constant_force_moves_the_spring_or_stands_beside_it():
    text = "inertia: {mass: 1.0}\nforce: [{constant_force: {force: 2.0}}%s]"
    assert joint(text % ", {linear_spring: {stiffness: 10.0, rest_length: 1.0}}").spring_reference == 1.2
    model = mujoco.MjModel.from_xml_string(exported([joint(text % "")], "mujoco"))
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    assert data.qacc[0] == pytest.approx(2.0)


def test_urdf_has_dynamics_and_limits():
    text = PENDULUM.replace("force:", "actuator: [{actuator_saturation: {limit: 1.5}}]\nforce:").replace(
        "{viscous", "{coulomb_friction: {force: 0.03}}, {viscous"
    )
    root = tree.fromstring(exported([joint(text)], "urdf"))
    dynamics, limit = root.find("joint/dynamics"), root.find("joint/limit")
    assert dynamics is not None and dynamics.attrib == {"damping": "0.01", "friction": "0.03"}
    assert limit is not None and limit.get("effort") == "1.5"
    model = mujoco.MjModel.from_xml_string(exported([joint(text)], "urdf"))
    assert (model.dof_damping[0], model.dof_frictionloss[0]) == (0.01, 0.03)


def test_sdf_has_dynamics_and_the_plugin_of_the_command():
    root = tree.fromstring(exported([joint(DRY)], "sdf"))
    dynamics = {one.tag: float(one.text or "") for one in root.findall("model/joint/axis/dynamics/*")}
    assert dynamics == {"damping": 1.0, "friction": 1.0, "spring_reference": 0.0, "spring_stiffness": 200.0}
    plugin = tree.fromstring(exported([joint(SERVO)], "sdf")).find("model/plugin")
    assert plugin is not None and plugin.get("name") == "gz::sim::systems::JointPositionController"
    assert float(plugin.findtext("p_gain", "")) == pytest.approx(6.4)


def test_isaac_is_python_with_delays_in_physics_steps():
    module = ast.parse(exported([joint(SERVO)], "isaac"))
    call = next(one for one in ast.walk(module) if isinstance(one, ast.Call) and one.keywords)
    arguments = {one.arg: ast.unparse(one.value) for one in call.keywords}
    assert ast.unparse(call.func) == "DelayedPDActuatorCfg"
    assert (arguments["stiffness"], arguments["damping"]) == ("6.4", "0.24")
    assert arguments["viscous_friction"] == "0.05"
    assert arguments["armature"] == "0.05 - LINK_INERTIA['knee']"
    for name in ("min_delay", "max_delay"):
        assert eval(arguments[name], {"PHYSICS_STEP": 0.005, "round": round}) == 4


def test_isaac_takes_friction_at_rest_and_while_sliding():
    text = DRY.replace(
        "coulomb_friction: {force: 1.0, ", "stribeck_friction: {force: 1.0, static_ratio: 1.5, stribeck_speed: 0.1, "
    )  # fmt: skip
    written = exported([joint(text)], "isaac")
    assert "friction=1.5," in written and "dynamic_friction=1.0," in written


def test_the_matlab_script_holds_the_state_space_and_its_delays():
    lines = exported([joint(LINEAR)], "matlab").splitlines()
    values = dict(line.split(";")[0].split(" = ", 1) for line in lines if " = " in line)
    rows = values["joint(1).A"].strip("[]")
    assert rows == "0.0 1.0 0.0"  # the first row of the matrix
    a = next(line for line in lines if ".A = " in line).split(" = ")[1].strip("[];")
    matrix = np.array([[float(one) for one in row.split()] for row in a.split(";")])
    np.testing.assert_allclose(matrix, linear_part(joint(LINEAR)).a)
    assert "'InputDelay', 0.0125, 'OutputDelay', 0.006" in lines[-1]


def test_csv_reads_back_to_the_joint():
    rows = list(csv.DictReader(io.StringIO(exported([joint(SERVO)], "csv"))))
    numbers = {row["quantity"]: float(row["value"]) for row in rows if row["unit"]}
    units = {row["quantity"]: row["unit"] for row in rows}
    assert numbers["position_gain"] == 8.0 and units["position_gain"] == "N*m/rad"
    described = joint(SERVO)
    for name, value in numbers.items():
        assert getattr(described, name) == value


def test_nav2_reads_the_delay_of_the_axis():
    wheel = joint(
        "inertia: {mass: {value: 1.0, unit: kg*m^2}}\ncommand: [{input_delay: {delay: 0.3}}]", "yaw"
    )
    read = yaml.safe_load(exported([joint(LINEAR), wheel], "nav2"))
    path = read["controller_server"]["ros__parameters"]["FollowPath"]
    assert path["model_delay_vx"] == pytest.approx(0.0125 + 0.008)
    assert path["model_delay_wz"] == 0.3
    with pytest.raises(InputError, match="at most one"):
        exported([wheel, replace(wheel, name="roll")], "nav2")


def present(element) -> dict[str, float]:
    """Values at which the effect is there."""
    values = {one.name: 1.0 if one.default is None else one.default for one in element.parameters}
    if element.size and values[element.size] == element.absent:
        values[element.size] = 0.5 if element.absent == 1.0 else 0.05
    return values


def test_no_effect_is_dropped_in_silence():
    rotational = "inertia: {mass: {value: 1.0, unit: kg*m^2}}\nforce: [{linear_spring: {stiffness: 10.0}}]"
    free = Model.from_text(rotational)
    controlled = Model.from_text(rotational + "\ncommand: [{position_control: {proportional: 5.0}}]")
    plain = {
        model is free: {to: exported([joint_of(model, "knee")], to) for to in WRITERS}
        for model in (free, controlled)
    }
    seen = 0
    for element in load_catalogue().values():
        model = controlled if element.controlled or element.acts == "observation" else free
        borrowed = (source for source, default in element.borrows.values() if default is None)
        if not all(source in model.parameters for source in borrowed):
            continue
        described = joint_of(model.with_element(element, present(element)), "knee")
        for target in WRITERS:
            written = exported([described], target)
            assert written != plain[model is free][target], (element.name, target)
            assert element.name in READERS or element.name in written
        seen += 1
    assert seen > 40


@given(inertia=some.floats(1e-6, 1e3), moment=some.floats(1e-3, 1e3), hanging=some.floats(-math.pi, math.pi))
def test_a_hanging_link_has_the_inertia_and_the_weight(inertia, moment, hanging):
    link = link_of(Joint("knee", True, inertia, weight_moment=moment, hanging_position=hanging))
    lever = math.hypot(*link.centre)
    assert link.inertia + link.mass * lever**2 == pytest.approx(inertia)
    assert link.mass * STANDARD_GRAVITY * lever == pytest.approx(moment)


def test_several_joints_stand_in_one_file():
    joints = [joint(SERVO, "hip"), joint(MOTOR, "knee")]
    model = mujoco.MjModel.from_xml_string(exported(joints, "mujoco"))
    assert (model.njnt, model.nu, model.nsensor) == (2, 2, 2)
    assert mujoco.MjModel.from_xml_string(exported(joints, "urdf")).njnt == 2
    with pytest.raises(InputError, match="different gravities"):
        exported([joint(HANGING, "leg"), *joints], "mujoco")
    with pytest.raises(InputError, match="different names"):
        exported([joints[0], joints[0]], "csv")


def test_no_source_can_break_a_file():
    described = joint(SERVO)
    for source in ('a"""b\n# -- c', "x--->y\x00"):
        for target in WRITERS:
            written = exported([described], target, source)
            if written.startswith("<"):
                tree.fromstring(written)
            elif target == "isaac":
                ast.parse(written)
            elif target == "nav2":
                yaml.safe_load(written)


@pytest.mark.parametrize(
    ("text", "arguments", "says"),
    [
        ("units: {force: V, position: px, mass: g}\ninertia: {mass: 1.0}", ["--to", "urdf"], "simulators take SI"),
        (LINEAR, ["--to", "urdf", "--out", "model.yaml"], "exists already"),
        (LINEAR, [], "--to"),
    ],
    ids=["units", "out", "no target"],
)  # fmt: skip
def test_bad_input_is_refused_in_one_line(tmp_path, command, text, arguments, says):
    (tmp_path / "model.yaml").write_text(text, encoding="utf-8")
    done = command("export", "model.yaml", *arguments)
    assert (done.code, done.out) == (2, "")
    assert says in done.err and done.err.count("\n") == 1
    assert [one.name for one in tmp_path.iterdir()] == ["model.yaml"]


def test_what_no_simulator_can_take_is_refused():
    two = SERVO.replace("{position_control", "{velocity_control: {gain: 1.0}}, {position_control")
    with pytest.raises(InputError, match="two controllers"):
        joint(two)
    with pytest.raises(InputError, match="resistance is 0"):
        joint(MOTOR.replace("resistance: 2.0", "resistance: 0.0"))
    for name in ("left knee", "", "2nd", 'a"b'):
        with pytest.raises(InputError, match="--joint"):
            joint(LINEAR, name)
    with pytest.raises(InputError, match="--to gazebo: is none of mujoco, urdf"):
        exported([joint(LINEAR)], "gazebo")


def test_the_command_writes_a_file_or_to_the_terminal(tmp_path, command):
    (tmp_path / "model.yaml").write_text(LINEAR, encoding="utf-8")
    shown = command("export", "model.yaml", "--to", "mujoco", "--joint", "knee")
    saved = command("export", "model.yaml", "--to", "mujoco", "--joint", "knee", "--out", "out/knee.xml")
    assert (shown.code, saved.code, saved.out) == (0, 0, "out/knee.xml: knee for mujoco\n")
    assert (tmp_path / "out/knee.xml").read_text(encoding="utf-8") == shown.out
    assert mujoco.MjModel.from_xml_path(str(tmp_path / "out/knee.xml")).nu == 1
