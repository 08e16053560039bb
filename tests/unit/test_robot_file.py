"""Robot files as they are published: meshes by package, links without mass, inertias that no body has."""

from pathlib import Path

import mujoco
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rhythmid.body.machine import Machine
from rhythmid.body.mujoco_body import MujocoBody
from rhythmid.body.robot_file import mesh_file, possible_moments, read_robot
from rhythmid.body.write_back import save_machine
from rhythmid.errors import InputError

LINK = '<inertial><origin xyz="0 0 -0.1"/><mass value="{mass}"/><inertia ixx="{ixx}" iyy="0.01" izz="{izz}" ixy="0" ixz="0" iyz="0"/></inertial>'
MESH = '<collision><geometry><mesh filename="{mesh}"/></geometry></collision>'
TETRAHEDRON = """v 0 0 0\nv 0.1 0 0\nv 0 0.1 0\nv 0 0 0.1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n"""


def urdf(
    mesh: str = "package://arm/meshes/upper.dae", mass: float = 1.0, ixx: float = 0.01, izz: float = 0.001
) -> str:
    """An arm: a base, a link that moves, a tool fixed to it, and a finger without mass."""
    link = LINK.format(mass=mass, ixx=ixx, izz=izz)
    return f"""<robot name="arm"><link name="base"/>
<link name="upper">{link}{MESH.format(mesh=mesh)}</link>
<link name="tool">{LINK.format(mass=0.5, ixx=0.01, izz=0.001)}</link>
<link name="finger"><visual><geometry><sphere radius="0.01"/></geometry></visual></link>
<joint name="shoulder" type="continuous"><parent link="base"/><child link="upper"/><axis xyz="0 1 0"/></joint>
<joint name="mount" type="fixed"><parent link="upper"/><child link="tool"/><origin xyz="0 0 -0.3"/></joint>
<joint name="grip" type="prismatic"><parent link="tool"/><child link="finger"/><axis xyz="1 0 0"/><limit lower="0" upper="0.01" effort="1" velocity="1"/></joint>
</robot>"""


def written(folder: Path, **values: object) -> Path:
    path = folder / "arm.urdf"
    path.write_text(urdf(**values))  # pyright: ignore[reportArgumentType]
    return path


def test_meshes_do_not_matter_where_nothing_touches(tmp_path: Path):
    body = MujocoBody.load(written(tmp_path), contacts=False)
    assert list(body.joints) == ["shoulder"]
    assert body.parameters["upper.mass"] == pytest.approx(1.5)  # the tool is a part of it


@pytest.mark.parametrize(
    ("end", "joint", "link"), [("parent", "shoulder", "base"), ("child", "grip", "finger")]
)
def test_a_link_that_a_joint_names_and_the_file_lacks_is_told(
    tmp_path: Path, end: str, joint: str, link: str
):
    path = written(tmp_path)
    path.write_text(path.read_text().replace(f'<link name="{link}"', f'<link name="other_{link}"'))
    with pytest.raises(InputError) as caught:
        MujocoBody.load(path, contacts=False)
    assert f"joint {joint!r} has the {end} link {link!r}, which the file lacks" in str(caught.value)
    assert "\n" not in str(caught.value) and f'<link name="{link}"/>' in str(caught.value)


def test_a_mesh_that_contacts_need_and_nobody_can_read_is_told_with_what_to_do(tmp_path: Path):
    with pytest.raises(InputError, match=r"upper\.dae.*contacts: false") as caught:
        MujocoBody.load(written(tmp_path))
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("place", ["above", "ROS_PACKAGE_PATH", "AMENT_PREFIX_PATH", "beside"])
def test_a_mesh_is_found_where_ros_puts_packages(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, place: str):
    folder = {
        "above": tmp_path / "arm",
        "ROS_PACKAGE_PATH": tmp_path / "ws" / "arm",
        "AMENT_PREFIX_PATH": tmp_path / "opt" / "share" / "arm",
        "beside": tmp_path / "arm" / "urdf",
    }[place]
    (folder / "meshes").mkdir(parents=True)
    (folder / "meshes" / "upper.obj").write_text(TETRAHEDRON)
    (tmp_path / "arm" / "urdf").mkdir(parents=True, exist_ok=True)
    monkeypatch.setenv("ROS_PACKAGE_PATH", str(tmp_path / "ws"))
    monkeypatch.setenv("AMENT_PREFIX_PATH", str(tmp_path / "opt"))
    name = "meshes/upper.obj" if place == "beside" else "package://arm/meshes/upper.obj"
    body = MujocoBody.load(written(tmp_path / "arm" / "urdf", mesh=name))
    assert body.model.nmesh == 1
    assert mesh_file("package://hand/meshes/upper.obj", tmp_path / "arm" / "urdf") is None


def test_joints_that_move_no_mass_are_held_fast_and_told(tmp_path: Path):
    notes = MujocoBody.load(written(tmp_path), contacts=False).notes
    assert notes == ("held fast, because what they move has no mass: grip",)
    (tmp_path / "arm.yaml").write_text(
        "body: {urdf: arm.urdf, contacts: false}\njoints: {shoulder: {}, grip: {}}\n"
    )
    with pytest.raises(InputError, match="grip: moves no mass in arm.urdf; give its link a mass there"):
        Machine.load(tmp_path / "arm.yaml")


def test_an_inertia_that_no_body_has_is_replaced_by_the_nearest_and_told(tmp_path: Path):
    body = MujocoBody.load(written(tmp_path, ixx=0.1), contacts=False)
    assert any("inertia of link 'upper' is that of no rigid body" in note for note in body.notes)


def test_an_inertia_that_is_impossible_through_rounding_only_is_not_told(tmp_path: Path):
    body = MujocoBody.load(written(tmp_path, ixx=0.010001, izz=0.000001), contacts=False)
    assert len(body.notes) == 1


@given(st.lists(st.floats(-1.0, 1.0), min_size=3, max_size=3))
def test_possible_moments_are_those_of_a_rigid_body_and_near(given_moments: list[float]):
    moments = np.sort(given_moments)
    low, middle, high = possible_moments(moments)
    assert 0.0 < low <= middle <= high <= (low + middle) * (1.0 + 1e-12)
    if moments[0] >= 1e-6 and moments[2] <= moments[0] + moments[1]:
        np.testing.assert_array_equal((low, middle, high), moments)


def test_mujocos_warnings_are_notes_and_leave_no_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "arm.urdf").write_text(urdf().replace('upper="0.01"', 'upper="0"'))
    body = MujocoBody.load(tmp_path / "arm.urdf", contacts=False)
    assert "joint 'grip' has equal lower and upper limits, limit ignored" in body.notes
    assert sorted(one.name for one in tmp_path.iterdir()) == ["arm.urdf"]
    assert capfd.readouterr() == ("", "")


def test_a_link_that_is_fixed_to_another_is_scaled_with_it(tmp_path: Path):
    written(tmp_path)
    (tmp_path / "arm.yaml").write_text("body: {urdf: arm.urdf, contacts: false}\njoints: {shoulder: {}}\n")
    machine = Machine.load(tmp_path / "arm.yaml").with_inertial({"upper.mass": 3.0})
    for name in ("better.urdf", "better.xml"):
        save_machine(machine, tmp_path / name)
        again = MujocoBody.load(tmp_path / name, contacts=False)
        assert again.parameters["upper.mass"] == pytest.approx(3.0)
        motion = np.array([[0.3]]), np.array([[0.5]]), np.array([[2.0]])
        np.testing.assert_allclose(again.inverse(*motion), machine.body.inverse(*motion), rtol=1e-9)


def test_an_mjcf_with_meshes_is_written_into_another_folder(tmp_path: Path):
    (tmp_path / "robot" / "meshes").mkdir(parents=True)
    (tmp_path / "robot" / "meshes" / "upper.obj").write_text(TETRAHEDRON)
    (tmp_path / "robot" / "arm.xml").write_text(
        "<mujoco><compiler meshdir='meshes'/><asset><mesh name='upper' file='upper.obj'/></asset><worldbody><body name='upper'>"
        "<joint name='shoulder' axis='0 1 0'/><geom type='mesh' mesh='upper' mass='1'/></body></worldbody></mujoco>"
    )
    (tmp_path / "robot" / "arm.yaml").write_text("body: {mjcf: arm.xml}\njoints: {shoulder: {}}\n")
    save_machine(Machine.load(tmp_path / "robot" / "arm.yaml"), tmp_path / "better.xml")
    assert mujoco.MjModel.from_xml_path(str(tmp_path / "better.xml")).nmesh == 1


HELD = """<mujoco><compiler angle="degree"/><worldbody><body name="upper" pos="0 0 1" euler="0 30 0">
<joint name="shoulder" axis="0 1 0"/><geom size="0.1" mass="1" pos="0.2 0 0"/>
<body name="lower" pos="0.4 0 0" euler="10 0 20"><joint name="elbow" axis="0 1 1" pos="0.05 0 0.02" ref="15"/><geom size="0.05" mass="2" pos="0.3 0.1 0"/>
<body name="tip" pos="0.3 0 0"><joint name="reach" type="slide" axis="1 0 0"/><geom size="0.02" mass="0.3"/></body></body></body></worldbody>
<keyframe><key qpos="0.1 0.2 0.03"/></keyframe><actuator><motor joint="elbow"/><motor joint="shoulder"/></actuator>
<sensor><jointpos joint="elbow"/></sensor><equality><joint joint1="elbow" joint2="reach"/></equality></mujoco>"""


def test_joints_that_are_held_fast_leave_the_body_that_it_is_at_their_positions(tmp_path: Path):
    path = tmp_path / "arm.xml"
    path.write_text(HELD)
    at = {"elbow": -0.7, "reach": 0.08}
    held, free = MujocoBody.load(path, hold=at), MujocoBody.load(path)
    assert list(held.joints) == ["shoulder"]
    q, v, a = 0.4, 1.5, -3.0
    whole = free.inverse(np.array([[q, *at.values()]]), np.array([[v, 0.0, 0.0]]), np.array([[a, 0.0, 0.0]]))
    alone = held.inverse(np.array([[q]]), np.array([[v]]), np.array([[a]]))
    np.testing.assert_allclose(alone[:, 0], whole[:, 0], rtol=1e-12)


def test_a_coupling_between_joints_is_told_until_one_of_them_is_held(tmp_path: Path):
    path = tmp_path / "arm.xml"
    path.write_text(HELD)
    assert "the file couples elbow to reach" in MujocoBody.load(path).notes[0]
    assert MujocoBody.load(path, hold={"elbow": 0.0}).notes == ()


def test_a_machine_keeps_what_it_holds_fast(tmp_path: Path):
    written(tmp_path)
    text = "body: {urdf: arm.urdf, contacts: false, hold: {shoulder: 0.5}}\njoints: {shoulder: {}}\n"
    (tmp_path / "arm.yaml").write_text(text)
    with pytest.raises(InputError, match="has no hinge and no slide"):
        Machine.load(tmp_path / "arm.yaml")
    (tmp_path / "arm.yaml").write_text(text.replace("shoulder: 0.5", "wrist: 0.5"))
    with pytest.raises(InputError, match="hold: has no hinge or slide 'wrist'; its joints: shoulder"):
        Machine.load(tmp_path / "arm.yaml")
    (tmp_path / "two.xml").write_text(HELD)
    (tmp_path / "two.yaml").write_text(
        "body: {mjcf: two.xml, hold: [elbow, reach]}\njoints: {shoulder: {}}\n"
    )
    machine = Machine.load(tmp_path / "two.yaml")
    machine.save(tmp_path / "again.yaml")
    assert Machine.load(tmp_path / "again.yaml").body.hold == {"elbow": 0.0, "reach": 0.0}
    save_machine(machine, tmp_path / "better.xml")
    assert list(MujocoBody.load(tmp_path / "better.xml").joints) == ["shoulder"]


@pytest.mark.parametrize("again", ['<origin xyz="0 0 9"/>', '<parent link="finger"/>'])
def test_an_element_of_a_joint_that_stands_again_is_left_out_with_a_note(tmp_path: Path, again: str):
    path = written(tmp_path)
    once = MujocoBody.load(path, contacts=False)
    path.write_text(path.read_text().replace('<origin xyz="0 0 -0.3"/>', f'<origin xyz="0 0 -0.3"/>{again}'))
    twice = MujocoBody.load(path, contacts=False)
    assert twice.parameters["upper.mass"] == pytest.approx(once.parameters["upper.mass"])
    notes = read_robot(path, contacts=False).notes
    assert any("joint 'mount' has a further <" in note and "the first one is taken" in note for note in notes)
