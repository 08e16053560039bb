"""The rotational inertia of a link: a parameter of the body, a cause that a diagnosis names, and what the files that are written have of it."""

from dataclasses import replace
from pathlib import Path

import legged
import numpy as np
import pytest
from legged import MODELS, fixed_leg, recorded, references

from rhythmid.body.link_inertia import Principal
from rhythmid.body.machine import Machine
from rhythmid.body.mujoco_body import MujocoBody
from rhythmid.body.write_back import save_machine
from rhythmid.diagnose.joints.joint_diagnosis import MachineAnswer, diagnose_machine
from rhythmid.errors import InputError
from rhythmid.identify.joints.joint_motion import JointBalances
from rhythmid.record.joint_record import JointRecord

TWO_LINKS = """<robot name="two">
  <link name="base"/>
  <link name="upper"><inertial><origin xyz="0 0 -0.2"/><mass value="2"/>
    <inertia ixx="0.03" iyy="0.03" izz="0.002" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <link name="lower"><inertial><origin xyz="0 0.02 -0.15" rpy="0.1 0.2 0"/><mass value="1"/>
    <inertia ixx="0.01" iyy="0.012" izz="0.004" ixy="0.001" ixz="0" iyz="0"/></inertial></link>
  <link name="tool"><inertial><origin xyz="0 0 0.05"/><mass value="0.3"/>
    <inertia ixx="0.001" iyy="0.001" izz="0.001" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <joint name="one" type="revolute"><parent link="base"/><child link="upper"/><axis xyz="0 1 0"/>
    <limit lower="-3" upper="3" effort="50" velocity="10"/></joint>
  <joint name="two" type="revolute"><parent link="upper"/><child link="lower"/><origin xyz="0 0 -0.4"/><axis xyz="0 1 0"/>
    <limit lower="-3" upper="3" effort="50" velocity="10"/></joint>
  <joint name="grip" type="fixed"><parent link="lower"/><child link="tool"/><origin xyz="0.1 0 -0.3" rpy="0 0.4 0"/></joint>
</robot>
"""
Motion = tuple[np.ndarray, np.ndarray, np.ndarray]


def random_motion(body: MujocoBody) -> Motion:
    rng, model = np.random.default_rng(3), body.model
    count = (model.nq, model.nv, model.nv)
    return rng.normal(size=(6, count[0])), rng.normal(size=(6, count[1])), rng.normal(size=(6, count[2]))


def swung(plant: Machine, seconds: float = 5.0) -> JointRecord:
    time, rng = np.arange(0.0, seconds, 0.002), np.random.default_rng(3)
    asked = references({"hip": (0.6, 0.3), "knee": (-1.2, 0.3)}, time, rng, (0.5, 5.0))
    return recorded(plant, asked, time, rng)


@pytest.fixture(scope="module")
def leg(tmp_path_factory: pytest.TempPathFactory) -> Machine:
    return Machine.load(fixed_leg(tmp_path_factory.mktemp("leg")))


@pytest.mark.parametrize("name", ["leg", "arm", "quadruped"])
def test_an_inertia_adds_its_column_to_the_forces_and_keeps_mass_and_shape(name: str):
    body = Machine.load(MODELS / f"{name}.yaml").body
    motion = random_motion(body)
    for link in body.hinges:
        own, known = f"{link}.inertia", body.parameters
        (column,) = np.moveaxis(body.columns([own], *motion), 2, 0)
        lighter = body.with_parameters({own: 0.3 * known[own]})
        expected = body.inverse(*motion) - 0.7 * known[own] * column
        np.testing.assert_allclose(lighter.inverse(*motion), expected, atol=1e-9)
        before, after = body.own(link), lighter.own(link)
        assert after.mass == before.mass
        np.testing.assert_allclose(after.moments, 0.3 * before.moments)  # of a body, as those were


def test_an_inertia_that_is_given_stays_with_any_mass():
    body = Machine.load(MODELS / "leg.yaml").body
    given = body.with_parameters({"shank.inertia": 0.002})
    motion = random_motion(body)
    (column,) = np.moveaxis(given.columns(["shank.mass"], *motion), 2, 0)
    heavier = given.with_parameters({"shank.mass": given.parameters["shank.mass"] + 0.1})
    assert heavier.parameters["shank.inertia"] == pytest.approx(0.002)
    np.testing.assert_allclose(heavier.inverse(*motion), given.inverse(*motion) + 0.1 * column, atol=1e-9)


def test_a_link_that_does_not_turn_has_no_inertia_of_its_own_and_a_negative_one_is_refused():
    body = Machine.load(MODELS / "leg.yaml").body
    assert "trunk" in body.links and list(body.hinges) == ["thigh", "shank"]
    with pytest.raises(InputError, match="inertia of link 'shank' must be 0 or greater, not -0.1"):
        body.with_parameters({"shank.inertia": -0.1})


def test_the_inertia_about_the_hinge_is_that_about_the_centre_and_that_of_its_mass():
    body = Machine.load(MODELS / "leg.yaml").body
    assert body.about_hinge("shank") == pytest.approx(0.001 + 0.22 * 0.08**2)
    ball = Principal(1.0, np.zeros(3), np.zeros(3), np.array([1.0, 0.0, 0.0, 0.0]))
    np.testing.assert_allclose(ball.turned(np.array([0.0, 1.0, 0.0]), 0.1).moments, 0.1)


@pytest.mark.parametrize("suffix", [".yaml", ".xml", ".urdf"])
def test_an_inertia_is_in_the_files_that_are_written(tmp_path: Path, suffix: str):
    (tmp_path / "two.urdf").write_text(TWO_LINKS)
    (tmp_path / "two.yaml").write_text(
        "body: {urdf: two.urdf, contacts: false}\njoints: {one: {}, two: {}}\n"
    )
    machine = Machine.load(tmp_path / "two.yaml").with_inertial(
        {"lower.mass": 1.5, "lower.inertia": 0.02, "upper.inertia": 0.01}
    )
    save_machine(machine, tmp_path / f"new{suffix}")
    if suffix == ".yaml":
        again = Machine.load(tmp_path / "new.yaml").body
    else:
        again = MujocoBody.load(tmp_path / f"new{suffix}", contacts=False)
    motion = random_motion(again)
    np.testing.assert_allclose(again.inverse(*motion), machine.body.inverse(*motion), atol=1e-9)


def named(answer: MachineAnswer) -> dict[str | None, tuple[str, str | None]]:
    return {one.joint: (one.element, one.link) for one in answer.diagnosis.missing}


@pytest.mark.parametrize(
    "share", [pytest.param(0.3, id="lighter", marks=pytest.mark.long), pytest.param(2.4, id="heavier")]
)
def test_a_links_wrong_inertia_is_named_with_its_value_and_the_files(leg: Machine, share: float):
    known = leg.body.parameters["shank.inertia"]
    answer = diagnose_machine([swung(leg.with_inertial({"shank.inertia": share * known}))], leg)
    assert named(answer) == {"knee": ("link_inertia", "shank")}
    (one,) = answer.diagnosis.missing
    assert one.parameters["inertia"].value == pytest.approx(share * known, abs=0.1 * known)
    assert any("shank.inertia: 0.001 kg*m^2 in the nominal model" in note for note in answer.diagnosis.notes)
    assert answer.machine.body.parameters["shank.inertia"] == pytest.approx(share * known, abs=0.1 * known)


@pytest.mark.long
def test_inertias_about_the_joints_in_the_file_are_named_though_the_rotors_are_free(leg: Machine):
    """A file that takes both for those about the centres: what is too much at the first joint is more than its rotor."""
    bare = leg.with_inertial({"hip.armature": 0.0})
    wrong = {f"{link}.inertia": 3.0 * bare.body.about_hinge(link) for link in ("thigh", "shank")}
    told = bare.with_inertial(wrong)
    rotor = "body.hip.armature"
    told = told.with_parameters({rotor: replace(told.parameters[rotor], fixed=False)})
    answer = diagnose_machine([swung(bare)], told)
    links = {one.link: one.parameters for one in answer.diagnosis.missing if one.element == "link_inertia"}
    assert set(links) == {"thigh", "shank"}, answer.diagnosis.summary
    assert links["thigh"]["inertia"].value == pytest.approx(0.0028, abs=0.1 * wrong["thigh.inertia"])
    assert links["shank"]["inertia"].value == pytest.approx(0.001, abs=0.1 * wrong["shank.inertia"])


def test_an_inertia_that_does_what_the_rotor_does_is_left_to_the_rotor(leg: Machine):
    record = swung(leg)
    balances = JointBalances.of(leg, [record])
    known = leg.body.parameters
    assert balances.rotors("hip") == ("thigh.inertia",) and balances.rotors("knee") == ()
    most = balances.models["hip"].parameters["body.thigh.inertia"].bounds[1]
    assert most == pytest.approx(max(known["thigh.inertia"] - known["hip.armature"], 0.0))
    heavier = leg.with_inertial({"thigh.inertia": 2.5 * known["thigh.inertia"]})
    assert named(diagnose_machine([swung(heavier)], leg)) == {"hip": ("armature", None)}


# principal moments in MuJoCo's order, so that its compiler marks the frames as the same
ALIGNED = legged.TWO_LINKS.replace(' rpy="0.1 0.2 0"', "").replace(
    'ixx="0.01" iyy="0.012"', 'ixx="0.012" iyy="0.01"'
)
ALIGNED = ALIGNED.replace('-0.4"/><axis xyz="0 1 0"/>', '-0.4"/><axis xyz="1 0 0"/>')


def test_a_link_whose_file_has_its_inertia_along_the_frame_may_have_any_other(tmp_path: Path):
    def body(text: str) -> MujocoBody:
        (tmp_path / "two.urdf").write_text(text)
        return MujocoBody.load(tmp_path / "two.urdf", contacts=False)

    plain = body(ALIGNED)
    other = body(ALIGNED.replace('izz="0.004" ixy="0" ixz="0"', 'izz="0.004" ixy="0.002" ixz="0.001"'))
    at_origin = body(ALIGNED.replace('xyz="0 0.02 -0.15"', 'xyz="0 0 0"'))
    motion = random_motion(plain)
    change = other.inertial("lower") - plain.inertial("lower")
    asked = other.inverse(*motion)
    assert np.abs(asked - plain.inverse(*motion)).max() > 1e-4
    added = plain.inertial_columns("lower", *motion) @ change
    assert plain.inverse(*motion) + added == pytest.approx(asked, abs=1e-9)
    same = plain.with_inertials({"lower": other.inertial("lower")})
    assert same.inverse(*motion) == pytest.approx(asked, abs=1e-9)
    moved = at_origin.with_centres({"lower": np.array([0.0, 0.02, -0.15])})
    assert moved.inverse(*motion) == pytest.approx(plain.inverse(*motion), abs=1e-9)
