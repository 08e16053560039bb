"""Bodies as users' files write them, through MuJoCo and back: what was identified is in the file, and all else is as it was."""

import struct
from pathlib import Path

import mujoco
import numpy as np
import pytest

from rhythmid.body.machine import Machine
from rhythmid.body.write_back import save_machine
from rhythmid.elements.catalogue import load_catalogue
from rhythmid.errors import InputError

UPPER = '<inertial pos="0 0 -0.1" mass="2" diaginertia="0.02 0.02 0.004"/><geom type="capsule" fromto="0 0 0 0 0 -0.25" size="0.02"/>'
LOWER = '<inertial pos="0.01 0 -0.08" mass="0.7" diaginertia="0.004 0.004 0.001"/><geom type="capsule" fromto="0 0 0 0 0 -0.2" size="0.015"/>'


def arm(
    upper: str = UPPER,
    lower: str = LOWER,
    head: str = "",
    hip: str = "",
    knee: str = "",
    tail: str = "",
    child: str = "",
) -> str:
    """An MJCF of two links in which parts may be replaced."""
    return (
        f'<mujoco model="arm">{head}<worldbody><body name="upper" {child}><joint name="hip" axis="0 1 0" {hip}/>{upper}'
        f'<body name="lower" pos="0 0 -0.25"><joint name="knee" axis="0 1 0" {knee}/>{lower}</body></body></worldbody>{tail}</mujoco>'
    )


NESTED = (
    '<default><joint armature="0.01" damping="0.2"/><default class="leg"><joint frictionloss="0.3" armature="0.02"/>'
    '<default class="shin"><joint damping="0.05" armature="0.004" range="-1 2"/><general gear="3" ctrlrange="-1 1"/></default></default></default>'
)
URDF_LINK = (
    '<link name="{name}"><inertial><origin xyz="0 0 -0.1" rpy="0 0.1 0"/><mass value="{mass}"/>'
    '<inertia ixx="0.01" iyy="0.012" izz="0.004" ixy="0.0005" ixz="0" iyz="0"/></inertial>{more}</link>'
)
URDF = (
    '<robot name="arm"><link name="base"/>{upper}{lower}'
    '<joint name="hip" type="revolute"><parent link="base"/><child link="upper"/><axis xyz="0 1 0"/>{hip}</joint>'
    '<joint name="knee" type="continuous"><parent link="upper"/><child link="lower"/><origin xyz="0 0 -0.25"/><axis xyz="0 1 0"/>{knee}</joint></robot>'
)
LIMIT = '<limit lower="-1.5" upper="1.5" effort="40" velocity="8"/>'


def urdf(hip: str = LIMIT, knee: str = "", more: str = "") -> str:
    upper = URDF_LINK.format(name="upper", mass=2.0, more="")
    return URDF.format(
        upper=upper, lower=URDF_LINK.format(name="lower", mass=0.7, more=more), hip=hip, knee=knee
    )


def write_mesh(path: Path) -> None:
    """A tetrahedron as binary STL."""
    corners = 0.05 * np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], dtype=np.float32)
    faces = [(0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3)]
    made = b"".join(struct.pack("<12fH", 0, 0, 0, *corners[list(face)].ravel().tolist(), 0) for face in faces)
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(b"\0" * 80 + struct.pack("<I", len(faces)) + made)


FILES: dict[str, dict[str, str]] = {
    "plain": {"arm.xml": arm()},
    "include": {
        "arm.xml": arm(head='<include file="parts/defaults.xml"/>', lower='<include file="parts/lower.xml"/>'),
        "parts/defaults.xml": f"<mujocoinclude>{NESTED}</mujocoinclude>",
        "parts/lower.xml": f"<mujocoinclude>{LOWER}</mujocoinclude>",
    },
    "nested classes": {
        "arm.xml": arm(head=NESTED, child='childclass="leg"', knee='class="shin"',
                       tail='<actuator><general name="motor" joint="knee" class="shin"/><position joint="hip" kp="20" dampratio="1"/></actuator>')
    },
    "degrees": {
        "arm.xml": arm(head='<compiler angle="degree" autolimits="false"/>', hip='range="-90 60" limited="true" ref="30"',
                       knee='range="-100 5" limited="false" stiffness="2" springref="-45"')
    },
    "autolimits": {"arm.xml": arm(head='<compiler angle="radian" autolimits="true"/>', hip='range="-1 1"', knee='range="0 0"')},
    "inertia of shapes": {"arm.xml": arm(head='<compiler inertiafromgeom="true"/>')},
    "inertia of shapes alone": {
        "arm.xml": arm(upper='<geom type="box" size="0.02 0.03 0.1" pos="0 0 -0.1" density="2000"/>', lower='<geom type="sphere" size="0.05" mass="0.4"/>')
    },
    "total mass": {"arm.xml": arm(head='<compiler settotalmass="10" boundmass="0.1" boundinertia="0.001" balanceinertia="true"/>')},
    "spring and damper by time constant": {"arm.xml": arm(knee='springdamper="0.2 0.7"')},
    "polynomial losses": {"arm.xml": arm(knee='damping="0.3 0.02 0"')},
    "frames and key frame": {
        "arm.xml": arm(head='<compiler eulerseq="zyx"/>', lower=f'{LOWER}<frame euler="10 0 5"><body name="tip" pos="0 0 -0.2"><geom size="0.01" mass="0.1"/></body></frame>',
                       tail='<keyframe><key name="home" qpos="0.2 -0.4"/></keyframe>')
    },
    "actuators of other kinds": {
        "arm.xml": arm(tail='<actuator><motor joint="hip" gear="50" ctrllimited="true" ctrlrange="-1 1"/><velocity joint="knee" kv="3"/></actuator>'
                            '<sensor><jointpos joint="knee"/></sensor>')
    },
    "contact pairs and sites": {
        "arm.xml": arm(lower=f'{LOWER}<site name="foot" pos="0 0 -0.2"/>', tail='<contact><exclude body1="upper" body2="lower"/></contact>')
    },
    "urdf": {"arm.urdf": urdf()},
    "urdf with dynamics": {"arm.urdf": urdf(hip=f'{LIMIT}<dynamics damping="0.4"/>', knee='<dynamics friction="0.2" damping="0.1"/>')},
    "mesh": {
        "robot/arm.xml": arm(head='<compiler meshdir="../shapes"/><asset><mesh name="m" file="m.stl"/></asset>', lower='<geom type="mesh" mesh="m" density="4000"/>')
    },
    "mesh beside the file": {"robot/arm.xml": arm(head='<asset><mesh name="m" file="../shapes/m.stl" scale="2 2 2"/></asset>', lower=f'{LOWER}<geom type="mesh" mesh="m"/>')},
    "urdf with a mesh": {"robot/arm.urdf": urdf(more='<collision><geometry><mesh filename="../shapes/m.stl"/></geometry></collision>')},
    "urdf of a package": {"robot/urdf/arm.urdf": urdf(more='<collision><geometry><mesh filename="package://robot/meshes/m.stl"/></geometry></collision>')},
}  # fmt: skip


def loaded(folder: Path, parts: dict[str, str]) -> Machine:
    for name, text in parts.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text(text)
    write_mesh(folder / "shapes" / "m.stl")
    write_mesh(folder / "robot" / "meshes" / "m.stl")
    first = next(iter(parts))
    kind = "urdf" if first.endswith(".urdf") else "mjcf"
    (folder / "arm.yaml").write_text(f"body: {{{kind}: {first}}}\njoints: {{hip: {{}}, knee: {{}}}}\n")
    return Machine.load(folder / "arm.yaml")


def identified(machine: Machine) -> Machine:
    """The machine with other values, as an identification leaves them."""
    catalogue = load_catalogue()
    mass = 1.3 * machine.body.parameters["lower.mass"]
    made = machine.with_inertial({"lower.mass": mass, "knee.armature": 0.011})
    values = {
        "viscous_damper": {"damping": 0.07},
        "coulomb_friction": {"force": 0.25, "transition": 0.02},
    }
    for name, own in values.items():
        if made.paths["knee"].term(name) is None:
            made = made.with_element("knee", catalogue[name], own)
        else:
            made = made.with_values({f"knee.{name}.{key}": value for key, value in own.items()})
    return made


@pytest.mark.parametrize("name", FILES)
def test_what_was_identified_is_in_the_file_and_all_else_is_as_it_was(name: str, tmp_path: Path):
    machine = loaded(tmp_path / "given", FILES[name])
    better = identified(machine)
    out = tmp_path / "elsewhere" / "deep" / "better.xml"
    out.parent.mkdir(parents=True)
    save_machine(better, out)
    model = mujoco.MjModel.from_xml_path(str(out))
    knee = model.joint("knee")
    dof = int(knee.dofadr[0])
    assert np.ravel(model.dof_damping[dof])[0] == pytest.approx(0.07)
    assert model.dof_frictionloss[dof] == pytest.approx(0.25)
    assert model.dof_armature[dof] == pytest.approx(0.011)
    assert model.body("lower").mass[0] == pytest.approx(better.body.parameters["lower.mass"])
    given = better.body.model
    for attribute in (
        "jnt_range",
        "jnt_limited",
        "jnt_stiffness",
        "qpos0",
        "qpos_spring",
        "jnt_axis",
        "jnt_pos",
        "key_qpos",
    ):
        np.testing.assert_allclose(getattr(model, attribute), getattr(given, attribute), atol=1e-5, err_msg=attribute)  # fmt: skip
    assert model.ngeom == given.ngeom and model.nsite == given.nsite and model.nexclude == given.nexclude
    (tmp_path / "again.yaml").write_text(f"body: {{mjcf: {out}}}\njoints: {{hip: {{}}, knee: {{}}}}\n")
    again = Machine.load(tmp_path / "again.yaml")
    rng = np.random.default_rng(1)
    motion = [rng.normal(size=(20, given.nq)) for _ in range(3)]
    np.testing.assert_allclose(
        again.body.inverse(*motion), better.body.inverse(*motion), rtol=1e-5, atol=1e-6
    )


@pytest.mark.parametrize("name", [name for name, parts in FILES.items() if "urdf" in next(iter(parts))])
def test_a_urdf_is_written_with_all_that_it_can_say(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    machine = loaded(tmp_path / "given", FILES[name])
    better = identified(machine)
    out = tmp_path / "elsewhere" / "better.urdf"
    out.parent.mkdir(parents=True)
    left = save_machine(better, out)
    assert any("knee.armature" in line for line in left)
    monkeypatch.setenv("ROS_PACKAGE_PATH", str(tmp_path / "given"))  # where a package is found from anywhere
    (tmp_path / "again.yaml").write_text(f"body: {{urdf: {out}}}\njoints: {{hip: {{}}, knee: {{}}}}\n")
    again = Machine.load(tmp_path / "again.yaml")
    assert again.body.parameters["lower.mass"] == pytest.approx(better.body.parameters["lower.mass"])
    assert again.value("knee.viscous_damper.damping") == pytest.approx(0.07)
    assert again.value("knee.coulomb_friction.force") == pytest.approx(0.25)
    assert again.body.model.ngeom == better.body.model.ngeom


@pytest.mark.parametrize(
    ("parts", "said"),
    [
        ({"arm.xml": arm(head='<include file="parts/none.xml"/>')}, "none.xml"),
        ({"arm.xml": arm(knee='class="none"')}, "none"),
        (
            {"arm.xml": arm(head='<asset><mesh name="m" file="none.stl"/></asset>', lower=f'{LOWER}<geom type="mesh" mesh="m"/>')},
            "none.stl",
        ),
        ({"arm.xml": arm(head='<compiler autolimits="false"/>', knee='range="-1 1"')}, "limited"),
        ({"arm.xml": arm(head='<compiler inertiafromgeom="false"/>', lower='<geom size="0.1"/>')}, "lower"),
    ],
)  # fmt: skip
def test_a_file_that_cannot_be_used_is_told_in_one_line(
    parts: dict[str, str], said: str, tmp_path: Path, capfd: pytest.CaptureFixture[str]
):
    with pytest.raises(InputError, match=said) as caught:
        loaded(tmp_path, parts)
    assert "\n" not in str(caught.value) and "arm.xml" in str(caught.value)
    assert capfd.readouterr() == ("", "")
