"""Inertias of links that were fitted to the efforts are in the identified machine, its files and its verdict."""

from pathlib import Path

import mujoco
import numpy as np
import pytest
from legged import TWO_LINKS, recorded, references

from rhythmid.body.machine import Machine
from rhythmid.body.mujoco_body import MujocoBody
from rhythmid.body.write_back import save_machine
from rhythmid.elements.catalogue import load_catalogue
from rhythmid.errors import InputError
from rhythmid.identify.joints.joint_identification import identify_machine

CONTROL = "command: [{position_control: {proportional: 80, derivative: 3}}], force: [{viscous_damper: {damping: 0.3}}]"
HEAVY = {"mass": 1.6, "centre": [0.04, 0.05, -0.21], "inertia": [0.016, 0.018, 0.006, 0.0, 0.0, 0.0]}
ASKED = {"one": (0.4, 0.4), "two": (-0.8, 0.4)}


def two(folder: Path, body: str = "") -> Machine:
    (folder / "two.urdf").write_text(TWO_LINKS)
    (folder / "two.yaml").write_text(
        f"body: {{urdf: two.urdf, step: 0.001, contacts: false{body}}}\n"
        f"joints:\n  one: {{{CONTROL}}}\n  two: {{{CONTROL}}}\n"
    )
    return Machine.load(folder / "two.yaml")


def of_lower(inertial: dict[str, object]) -> str:
    return f", inertials: {{lower: {inertial}}}".replace("'", "")


def test_links_that_predict_unseen_efforts_better_are_in_the_machine_and_right_ones_stay(tmp_path: Path):
    given, plant = two(tmp_path), two(tmp_path, of_lower(HEAVY))
    rng, time = np.random.default_rng(5), np.arange(0.0, 8.0, 0.002)
    asked = references(ASKED, time, rng, (0.3, 2.0))
    found = identify_machine([recorded(plant, asked, time, rng)], given, free=False)
    assert found.effort_nrmse["two"] < 0.05 and found.usable  # with the file's inertias 0.57
    lower = found.machine.body.own("lower")
    assert lower.mass * lower.centre[2] == pytest.approx(
        1.6 * -0.21, rel=0.1
    )  # what gravity shows; the file has -0.15
    assert any("fitted to the efforts" in note for note in found.notes)
    found.machine.save(tmp_path / "better.yaml")
    again = Machine.load(tmp_path / "better.yaml").body.inertial("lower")
    np.testing.assert_allclose(again, found.machine.body.inertial("lower"), rtol=1e-9, atol=1e-12)
    right = identify_machine([recorded(given, asked, time, rng)], given, free=False)
    assert not right.machine.body.replaced


@pytest.mark.parametrize("suffix", [".xml", ".urdf"])
def test_inertials_of_a_machine_are_in_its_mjcf_and_urdf(tmp_path: Path, suffix: str):
    machine = two(tmp_path, of_lower(HEAVY))
    assert machine.body.own("lower").mass == 1.6
    np.testing.assert_allclose(machine.body.own("lower").centre, HEAVY["centre"])
    save_machine(machine, tmp_path / f"new{suffix}")
    again = MujocoBody.load(tmp_path / f"new{suffix}", contacts=False)
    for link in ("upper", "lower"):
        np.testing.assert_allclose(again.inertial(link), machine.body.inertial(link), rtol=1e-9, atol=1e-12)
    assert mujoco.MjModel.from_xml_path(str(tmp_path / f"new{suffix}")).body("lower").mass[0] == 1.6
    heavier = machine.with_inertial({"lower.mass": 3.2})  # in proportion, as for a mass of the file
    assert Machine.from_text(heavier.to_yaml(tmp_path), tmp_path, load_catalogue()).body.own("lower").moments.sum() == pytest.approx(2.0 * machine.body.own("lower").moments.sum())  # fmt: skip


@pytest.mark.parametrize(
    ("body", "said"),
    [
        (", inertials: {wrist: {mass: 1, centre: [0, 0, 0], inertia: [1, 1, 1, 0, 0, 0]}}", "no link 'wrist' that moves; those are upper, lower"),
        (of_lower({**HEAVY, "inertia": [1.0, 0.1, 0.1, 0.0, 0.0, 0.0]}), "that of no rigid body"),
        (of_lower({**HEAVY, "mass": 0.0}), "mass"),
        (of_lower({**HEAVY, "centre": [0.0, 0.0]}), "centre"),
    ],
)  # fmt: skip
def test_inertials_that_cannot_be_are_told_in_one_line(tmp_path: Path, body: str, said: str):
    with pytest.raises(InputError, match=said) as caught:
        two(tmp_path, body)
    assert "\n" not in str(caught.value)
