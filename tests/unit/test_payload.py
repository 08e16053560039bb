"""A payload at the end of a link: a parameter of the body, a cause that a diagnosis names, and what the files that are written have of it."""

from pathlib import Path

import numpy as np
import pytest
from legged import MODELS, TWO_LINKS, hop, recorded, references

from rhythmid.body.machine import Machine
from rhythmid.body.mujoco_body import MujocoBody
from rhythmid.body.write_back import save_machine
from rhythmid.diagnose.joints.joint_diagnosis import diagnose_machine
from rhythmid.errors import InputError

GRIPPER = 0.35  # kg


def random_motion(body: MujocoBody) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    rng = np.random.default_rng(3)
    return (
        rng.normal(size=(6, body.model.nq)),
        rng.normal(size=(6, body.model.nv)),
        rng.normal(size=(6, body.model.nv)),
    )


def written(folder: Path) -> Machine:
    (folder / "two.urdf").write_text(TWO_LINKS)
    (folder / "two.yaml").write_text("body: {urdf: two.urdf, contacts: false}\njoints: {one: {}, two: {}}\n")
    return Machine.load(folder / "two.yaml")


@pytest.mark.parametrize("name", ["leg", "arm", "quadruped"])
def test_a_payload_adds_its_column_to_the_forces_and_keeps_the_links_own_mass(name: str):
    body = Machine.load(MODELS / f"{name}.yaml").body
    link, motion = next(iter(body.ends)), random_motion(body)
    (column,) = np.moveaxis(body.columns([f"{link}.payload"], *motion), 2, 0)
    loaded = body.with_parameters({f"{link}.payload": GRIPPER})
    np.testing.assert_allclose(loaded.inverse(*motion), body.inverse(*motion) + GRIPPER * column, atol=1e-9)
    assert loaded.parameters[f"{link}.mass"] == pytest.approx(body.parameters[f"{link}.mass"])
    heavier = loaded.with_parameters({f"{link}.mass": 2.0 * body.parameters[f"{link}.mass"]})
    (own,) = np.moveaxis(body.columns([f"{link}.mass"], *motion), 2, 0)
    expected = loaded.inverse(*motion) + body.parameters[f"{link}.mass"] * own
    np.testing.assert_allclose(heavier.inverse(*motion), expected, atol=1e-9)
    unloaded = loaded.with_parameters({f"{link}.payload": 0.0})
    np.testing.assert_allclose(unloaded.inverse(*motion), body.inverse(*motion), atol=1e-9)


def test_only_the_last_link_of_a_chain_carries_a_payload():
    ends = {name: Machine.load(MODELS / f"{name}.yaml").body.ends for name in ("leg", "arm", "quadruped")}
    assert list(ends["leg"]) == ["shank"] and list(ends["arm"]) == ["link6"]
    assert list(ends["quadruped"]) == ["FL_calf", "FR_calf", "RL_calf", "RR_calf"]


def test_a_link_without_shapes_ends_at_twice_the_distance_of_its_centre(tmp_path: Path):
    np.testing.assert_allclose(written(tmp_path).body.ends["lower"], [0.0, 0.04, -0.3])


def test_a_negative_payload_is_refused():
    body = Machine.load(MODELS / "leg.yaml").body
    with pytest.raises(InputError, match="payload of link 'shank' must be 0 or greater, not -0.1"):
        body.with_parameters({"shank.payload": -0.1})


@pytest.mark.parametrize("suffix", [".yaml", ".xml", ".urdf"])
def test_a_payload_is_in_the_files_that_are_written(tmp_path: Path, suffix: str):
    machine = written(tmp_path).with_inertial({"lower.payload": GRIPPER, "lower.mass": 1.5})
    save_machine(machine, tmp_path / f"loaded{suffix}")
    again = (
        Machine.load(tmp_path / "loaded.yaml").body
        if suffix == ".yaml"
        else MujocoBody.load(tmp_path / f"loaded{suffix}", contacts=False)
    )
    motion = random_motion(machine.body)
    np.testing.assert_allclose(again.inverse(*motion), machine.body.inverse(*motion), atol=1e-5)


def test_the_place_of_a_payload_is_read_from_the_models_file_and_written_to_it(tmp_path: Path):
    place = np.array([0.01, 0.0, -0.25])
    written(tmp_path).with_payload("lower", GRIPPER, place).save(tmp_path / "loaded.yaml")
    again = Machine.load(tmp_path / "loaded.yaml")
    np.testing.assert_allclose(again.body.ends["lower"], place)
    assert again.body.parameters["lower.payload"] == pytest.approx(GRIPPER)


def test_a_place_of_a_payload_within_a_chain_is_refused(tmp_path: Path):
    written(tmp_path)
    (tmp_path / "two.yaml").write_text(
        "body: {urdf: two.urdf, contacts: false, ends: {upper: [0, 0, -1]}}\njoints: {one: {}}\n"
    )
    with pytest.raises(
        InputError, match=r"two.yaml.*'upper' is not the last link of a chain; those are lower"
    ):
        Machine.load(tmp_path / "two.yaml")


@pytest.mark.long  # test_payload_or_forces names a payload at the end of its link, with its mass
def test_a_payload_beside_the_end_of_its_link_is_named_with_its_mass_and_place():
    machine, place = Machine.load(MODELS / "leg.yaml"), np.array([0.03, 0.0, -0.25])
    loaded = machine.with_payload("shank", 0.2, place)
    time, rng = np.arange(0.0, 5.0, 0.002), np.random.default_rng(1)
    found = diagnose_machine([recorded(loaded, hop(time, rng), time, rng)], machine).diagnosis
    (one,) = found.missing
    assert (one.element, one.link, one.joint) == ("payload", "shank", "knee")
    assert one.parameters["mass"].value == pytest.approx(0.2, rel=0.05)
    assert one.parameters["x"].value == pytest.approx(place[0], abs=0.01)
    assert one.parameters["z"].value == pytest.approx(place[2], abs=0.01)
    assert "payload of shank" in found.summary
    assert {one.verdict for one in found.joints.values()} == {"consistent"}


@pytest.mark.long
def test_an_arms_hand_with_a_gripper_is_named_as_a_payload():
    machine = Machine.load(MODELS / "arm.yaml")
    loaded = machine.with_inertial({"link6.payload": GRIPPER})
    time, rng = np.arange(0.0, 8.0, 0.002), np.random.default_rng(2)
    middles = dict.fromkeys(machine.joints, (0.2, 0.35))
    found = diagnose_machine(
        [recorded(loaded, references(middles, time, rng, (0.15, 1.6)), time, rng)], machine
    ).diagnosis
    assert [(one.element, one.link) for one in found.missing] == [("payload", "link6")]
    assert found.missing[0].parameters["mass"].value == pytest.approx(GRIPPER, rel=0.1)
