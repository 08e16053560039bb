"""`rhythmid init --body`: from a robot's file and its recordings to the files of a machine of several joints."""

import json
from pathlib import Path

import foreign
import mujoco
import numpy as np
import pytest
from foreign import joint_state

from rhythmid.body.machine import Machine
from rhythmid.elements.catalogue import load_catalogue
from rhythmid.errors import InputError
from rhythmid.record.joint_record import load_joint_records
from rhythmid.start.families import joints_of
from rhythmid.start.robot import RobotStart, start_robot
from rhythmid.units import ROTATIONAL

LINK = '<inertial><origin xyz="0 0 -0.15"/><mass value="{mass}"/><inertia ixx="0.01" iyy="0.01" izz="0.001" ixy="0" ixz="0" iyz="0"/></inertial>'
JOINT = '<joint name="{name}" type="{kind}"><parent link="{above}"/><child link="{below}"/><origin xyz="0 0 {down}"/><axis xyz="0 1 0"/><limit lower="-3" upper="3" effort="9" velocity="9"/></joint>'
ARM = f"""<robot name="arm"><link name="base"/><link name="upper">{LINK.format(mass=1.0)}</link><link name="lower">{LINK.format(mass=0.5)}</link>
<link name="finger">{LINK.format(mass=0.05)}</link>{JOINT.format(name="shoulder_joint", kind="revolute", above="base", below="upper", down=0)}
{JOINT.format(name="elbow_joint", kind="revolute", above="upper", below="lower", down=-0.3)}
{JOINT.format(name="finger_joint", kind="prismatic", above="lower", below="finger", down=-0.3)}</robot>"""
FRICTION = 0.3
NOW = 1.7e9


@pytest.fixture(scope="module")
def run() -> dict[str, np.ndarray]:
    """Twelve seconds of the arm under a controller, its finger fast, and dry friction in the elbow."""
    spec = mujoco.MjSpec.from_string(ARM)
    spec.delete(spec.joint("finger_joint"))
    model = spec.compile()
    model.opt.timestep = 0.001
    model.dof_damping[:] = 0.05
    model.dof_frictionloss[1] = FRICTION
    data = mujoco.MjData(model)
    rng = np.random.default_rng(0)
    lines = rng.uniform(0.2, 1.5, (2, 5)), rng.uniform(0.0, 6.0, (2, 5))
    rows = {name: [] for name in ("time", "asked", "position", "effort")}
    for step in range(12000):
        asked = 0.25 * np.sin(2.0 * np.pi * lines[0] * data.time + lines[1]).sum(axis=1) * min(1.0, data.time)
        force = 60.0 * (asked - data.qpos) - 4.0 * data.qvel
        if step % 4 == 0:
            for name, value in zip(rows, (data.time, asked, data.qpos.copy(), force), strict=True):
                rows[name].append(value)
        data.qfrc_applied[:] = force
        mujoco.mj_step(model, data)
    return {name: np.array(values) for name, values in rows.items()}


@pytest.fixture
def robot(tmp_path: Path) -> Path:
    (tmp_path / "arm.urdf").write_text(ARM)
    return tmp_path / "arm.urdf"


def begun(source: Path, robot: Path, **more: float) -> RobotStart:
    return start_robot([source], robot, source.parent / "files", more.get("rate"), load_catalogue())


def table(path: Path, run: dict[str, np.ndarray], heads: list[str], *what: str) -> Path:
    columns = np.column_stack([run["time"], *(run[name] for name in what)])
    np.savetxt(path, columns, delimiter=",", header=",".join(["t", *heads]), comments="")
    return path


def test_a_robots_log_leads_to_the_joint_and_the_physics_that_its_file_lacks(tmp_path, robot, run, command):
    heads = [f"{kind}_{joint}" for kind in ("ref", "q", "tau") for joint in ("shoulder", "elbow")]
    table(tmp_path / "run.csv", run, heads, "asked", "position", "effort")
    said = command("init", "run.csv", "--body", "arm.urdf")
    assert (said.code, said.err) == (0, "")
    assert "CHECK held at zero, because not recorded: finger_joint" in said.out
    for line in [one.split()[1:] for one in said.out.splitlines() if one.startswith("  rhythmid ")]:
        done = command(*line, *(["--json", "answer.json"] if line[0] == "diagnose" else []))
        assert done.code == 0
    answer = json.loads((tmp_path / "answer.json").read_text())
    assert [(one["joint"], one["element"]) for one in answer["missing"]][:1] == [
        ("elbow_joint", "soft_constraint_friction")
    ]
    force = answer["missing"][0]["parameters"]["force"]
    assert force["value"] == pytest.approx(FRICTION, rel=0.1)


@pytest.mark.parametrize(
    ("heads", "joints"),
    [
        (["q_elbow_joint", "q_shoulder_joint"], "joints: [shoulder_joint, elbow_joint]"),
        (["q shoulder", "q elbow"], 'joints: {shoulder_joint: "shoulder", elbow_joint: "elbow"}'),
        (["q1", "q2"], 'joints: {shoulder_joint: "1", elbow_joint: "2"}'),
    ],
)
def test_joints_are_told_by_their_names_or_else_by_their_numbers(tmp_path, robot, run, heads, joints):
    efforts = [head.replace("q", "tau", 1) for head in heads]
    found = begun(table(tmp_path / "run.csv", run, [*heads, *efforts], "position", "effort"), robot)
    assert joints in found.signals
    assert any("they are numbered" in line for line in found.lines()) == ("1" in joints)


def test_joints_with_another_beginning_or_numbering_than_the_files_are_matched_with_a_check(
    tmp_path, robot, run
):
    def states(*names: str) -> Path:
        rows = zip(NOW + run["time"][:500], run["position"][:500], run["effort"][:500], strict=True)
        messages = [(at, joint_state(at, list(names), position=list(q), effort=list(f))) for at, q, f in rows]
        return foreign.write(tmp_path / "_".join(names), {"/joint_states": messages})

    found = begun(states("left_elbow", "left_shoulder"), robot)
    assert 'joints: {shoulder_joint: "left_shoulder", elbow_joint: "left_elbow"}' in found.signals
    assert any("other names than the robot's file" in line for line in found.doubts)
    panda, fer = ([f"{name}_joint{k}" for k in (1, 2)] for name in ("panda", "fer"))
    finger = "panda_finger_joint1"
    assert joints_of([*panda, finger], fer, told=True) == dict(zip(panda, fer, strict=True))
    assert joints_of(["pan", "lift"], ["axis_2", "axis_1"], told=True) == {"pan": "axis_1", "lift": "axis_2"}
    assert joints_of(["pan", "lift"], ["wheel", "steer"], told=True) == {}
    assert joints_of(["hip", "knee"], ["other_hip", "other_ankle"], told=True) == {}


def test_a_current_gets_a_check_of_its_unit(tmp_path, robot, run):
    for heads, doubted in ((["i1", "i2"], True), (["tau1", "tau2"], False), (["i1 [Nm]", "i2 [Nm]"], False)):
        found = begun(table(tmp_path / "run.csv", run, ["q1", "q2", *heads], "position", "effort"), robot)
        assert any("is called a current" in line for line in found.doubts) == doubted
        assert ("# CHECK effort: i* is called a current" in found.signals) == doubted


def test_a_force_comes_before_a_current_unless_it_never_acts(tmp_path, robot, run):
    heads = ["q1", "q2", "current_1", "current_2", "effort_1", "effort_2"]
    for size, taken in ((1.0, "effort_*"), (0.0, "current_*")):
        both = {**run, "force": size * run["effort"]}
        found = begun(table(tmp_path / "run.csv", both, heads, "position", "effort", "force"), robot)
        assert f'effort: {{column: "{taken}"' in found.signals


def test_efforts_with_other_numbers_than_the_positions_are_refused_with_how_to_go_on(tmp_path, robot, run):
    path = table(tmp_path / "run.csv", run, ["q0", "q1", "tau1", "tau2"], "position", "effort")
    with pytest.raises(
        InputError, match=r"q\* is numbered from 0, tau\* from 1; give the columns of one joint one number"
    ):
        begun(path, robot)


def test_units_of_headings_are_heeded(tmp_path, robot, run):
    degrees = {**run, "position": np.degrees(run["position"])}
    heads = ["q shoulder [deg]", "q elbow [deg]", "tau shoulder [Nm]", "tau elbow [Nm]"]
    found = begun(table(tmp_path / "run.csv", degrees, heads, "position", "effort"), robot)
    (tmp_path / "signals.yaml").write_text(found.signals)
    (record,) = load_joint_records([tmp_path / "run.csv"], tmp_path / "signals.yaml")
    np.testing.assert_allclose(
        record.joints["elbow_joint"].output.value, run["position"][:, 1], rtol=1e-6, atol=1e-9
    )


def test_entries_of_an_array_are_told_by_their_places(tmp_path, robot, run):
    np.savez(tmp_path / "run.npz", t=run["time"], q=run["position"], tau=run["effort"])
    found = begun(tmp_path / "run.npz", robot)
    assert "joints: [shoulder_joint, elbow_joint]" in found.signals
    assert 'output: {column: "q[*]"}' in found.signals and 'effort: {column: "tau[*]"' in found.signals


def test_of_several_efforts_the_one_that_was_measured_is_taken_and_the_others_are_named(tmp_path, robot, run):
    run = {**run, "friction": 0.1 * run["effort"], "measured": 0.9 * run["effort"]}
    heads = [f"{name}{joint}" for name in ("pos_meas", "tau_con", "tau_fric", "tau_meas") for joint in (1, 2)]
    path = table(tmp_path / "run.csv", run, heads, "position", "effort", "friction", "measured")
    found = begun(path, robot)
    assert 'effort: {column: "tau_meas*"' in found.signals
    checks = [line for line in found.lines() if line.startswith("CHECK effort")]
    assert any("tau_con*" in line for line in checks) and any("tau_fric*" in line for line in checks)
    assert "# CHECK effort: tau_con* is what" in found.signals
    found = begun(table(tmp_path / "run.csv", run, heads[:4], "position", "effort"), robot)
    assert 'effort: {column: "tau_con*"' in found.signals
    assert any("what the actuators were asked for" in line for line in found.lines())


def test_a_part_of_a_joints_name_says_nothing_of_its_references(tmp_path, robot, run):
    robot.write_text(ARM.replace("shoulder_joint", "axis_a").replace("elbow_joint", "axis_b"))
    for named in ("{}_{}", "{1}_{0}"):  # the letter of an acceleration is in both
        heads = [named.format(kind, joint) for kind in ("target", "pos") for joint in ("axis_a", "axis_b")]
        found = begun(table(tmp_path / "run.csv", run, heads, "asked", "position"), robot)
        column = named.format("target", "*")
        assert f'input: {{column: "{column}", kind: reference' in found.signals


def test_positions_that_the_measured_ones_follow_are_references_with_a_check(tmp_path, robot, run):
    heads = ["Position1", "Position2", "tau1", "tau2", "PositionPlan1", "PositionPlan2"]
    found = begun(table(tmp_path / "run.csv", run, heads, "position", "effort", "asked"), robot)
    assert 'input: {column: "PositionPlan*", kind: reference' in found.signals
    assert "# CHECK input: no name says that PositionPlan* was asked for" in found.signals
    damaged = {**run, "asked": np.where(run["time"][:, None] == run["time"][9], 1e120, run["asked"])}
    found = begun(table(tmp_path / "run.csv", damaged, heads, "position", "effort", "asked"), robot)
    assert "input:" not in found.signals.replace("CHECK input:", "")
    assert any("it is not used, because PositionPlan1" in line for line in found.doubts)


def test_a_torque_comes_before_a_current_by_any_of_its_words(tmp_path, robot, run):
    heads = ["Position1", "Position2", "Cur1", "Cur2", "TorqueCur1", "TorqueCur2"]
    found = begun(table(tmp_path / "run.csv", run, heads, "position", "effort", "effort"), robot)
    assert 'effort: {column: "TorqueCur*"' in found.signals
    found = begun(table(tmp_path / "run.csv", run, heads[:4], "position", "effort"), robot)
    assert "# CHECK effort: Cur* is called a current" in found.signals


def test_gains_are_estimated_where_reference_position_and_effort_were_recorded(tmp_path, robot, run):
    heads = [f"{kind}{joint}" for kind in ("ref", "q", "tau") for joint in (1, 2)]
    found = begun(table(tmp_path / "run.csv", run, heads, "asked", "position", "effort"), robot)
    machine = Machine.from_text(found.model.replace("../", ""), tmp_path, load_catalogue())
    for joint in ("shoulder_joint", "elbow_joint"):
        path = machine.paths[joint]
        assert path.value("position_control.proportional") == pytest.approx(60.0, rel=0.05)
        assert path.value("position_control.derivative") == pytest.approx(4.0, rel=0.1)
    assert "CHECK position_control: gains by least squares" in found.model


def test_the_friction_of_the_robots_file_is_written_into_the_model(tmp_path, robot, run):
    losses = '<dynamics damping="0.2" friction="0.7"/>'
    robot.write_text(
        ARM.replace(
            '<joint name="elbow_joint" type="revolute">',
            f'<joint name="elbow_joint" type="revolute">{losses}',
        )
    )
    found = begun(table(tmp_path / "run.csv", run, ["q1", "q2", "tau1", "tau2"], "position", "effort"), robot)
    assert "viscous_damper: {damping: 0.2}}, {coulomb_friction: {force: 0.7" in found.model


def test_columns_without_names_are_told_by_groups_of_one_column_for_each_joint(tmp_path, robot, run):
    speed = np.gradient(run["position"], run["time"], axis=0)
    columns = np.column_stack([run["time"], run["position"], speed, run["effort"]])
    np.savetxt(tmp_path / "run.csv", columns, delimiter=",")
    found = begun(tmp_path / "run.csv", robot)
    assert "output: {column: [1, 2]}" in found.signals and "effort: {column: [5, 6]" in found.signals
    assert "# CHECK output: no name says" in found.signals and "# CHECK effort: no name says" in found.signals
    (tmp_path / "signals.yaml").write_text(found.signals)
    (record,) = load_joint_records([tmp_path / "run.csv"], tmp_path / "signals.yaml")
    np.testing.assert_allclose(record.joints["elbow_joint"].output.value, run["position"][:, 1], atol=1e-12)
    np.savetxt(tmp_path / "run.csv", np.delete(columns, [3, 4], axis=1), delimiter=",")
    with pytest.raises(
        InputError,
        match="no measured position of a joint of arm.urdf is found: its columns have no names; .* first line of names",
    ):
        begun(tmp_path / "run.csv", robot)


@pytest.mark.parametrize("name", ["rail_pos", "rail_height"])
def test_a_recorded_joint_that_nothing_drives_and_that_moves_all_others_is_the_base(
    tmp_path, robot, run, name
):
    slide = JOINT.format(name="rail", kind="prismatic", above="base", below="carriage", down=0)
    robot.write_text(
        ARM.replace('<parent link="base"/>', '<parent link="carriage"/>').replace(
            "</robot>", f'<link name="carriage">{LINK.format(mass=1.0)}</link>{slide}</robot>'
        )
    )
    moving = {**run, "rail": 0.1 * run["position"][:, :1]}
    heads = ["shoulder_pos", "elbow_pos", "shoulder_tau", "elbow_tau", name]
    found = begun(table(tmp_path / "run.csv", moving, heads, "position", "effort", "rail"), robot)
    assert f'base: {{column: "{name}"}}' in found.signals and "  base: rail" in found.model
    assert "hold: [finger_joint]" in found.model
    (tmp_path / "signals.yaml").write_text(found.signals)
    (record,) = load_joint_records([tmp_path / "run.csv"], tmp_path / "signals.yaml")
    assert record.base is not None
    heads = ["shoulder_pos", "elbow_pos", "rail_tau", "elbow_tau", name.replace("height", "pos")]
    moving["rail"] = np.column_stack([run["position"][:, 0]])
    with pytest.raises(
        InputError,
        match="neither efforts nor references of shoulder were recorded, only positions; .* column of zeros",
    ):
        begun(
            table(
                tmp_path / "run.csv",
                moving,
                [*heads[:3], "elbow_tau", "rail_pos"],
                "position",
                "effort",
                "rail",
            ),
            robot,
        )


def test_references_alone_get_controllers_whose_gains_are_to_be_checked(tmp_path, robot, run):
    names = ["shoulder_joint", "elbow_joint"]
    times = NOW + run["time"]
    topics = {
        "/arm/joint_states": [
            (at, joint_state(at, names, position=list(q))) for at, q in zip(times, run["position"])
        ],
        "/arm/command": [
            (at, joint_state(at, names, position=list(q))) for at, q in zip(times, run["asked"])
        ],
    }
    found = begun(foreign.write(tmp_path / "bag", topics), robot)
    assert 'input: {topic: /arm/command, field: "position[*]", kind: reference}' in found.signals
    machine = Machine.from_text(found.model.replace("../", ""), tmp_path, load_catalogue())
    assert machine.controlled("elbow_joint") and machine.body.hold == {"finger_joint": 0.0}
    assert "CHECK position_control" in found.model
    assert machine.paths["elbow_joint"].units == ROTATIONAL


def test_a_log_without_joints_or_without_what_drives_them_is_refused(tmp_path, robot, run, command):
    table(tmp_path / "run.csv", run, ["x_shoulder", "x_elbow"], "position")
    with pytest.raises(InputError, match="neither efforts nor references of shoulder, elbow"):
        begun(tmp_path / "run.csv", robot)
    table(tmp_path / "run.csv", run, ["torque", "current"], "effort")
    with pytest.raises(InputError, match="no measured position of a joint of arm.urdf"):
        begun(tmp_path / "run.csv", robot)
    done = command("init", "run.csv", "--body", "arm.urdf", "--joint", "elbow")
    assert (done.code, done.err.strip()) == (
        2, "error: --joint is one joint, --body are all of a robot; give one of the two",
    )  # fmt: skip
    assert not (tmp_path / "signals.yaml").exists()
