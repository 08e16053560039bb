"""The centre of mass of a link: a place in the model's file, and what the files that are written have of it."""

from pathlib import Path

import numpy as np
import pytest
from legged import TWO_LINKS

from rhythmid.body.machine import Machine
from rhythmid.body.mujoco_body import MujocoBody
from rhythmid.body.write_back import save_machine
from rhythmid.errors import InputError

TOOL = """  <link name="tool"><inertial><origin xyz="0 0 0.05"/><mass value="0.3"/>
    <inertia ixx="0.001" iyy="0.001" izz="0.001" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <joint name="grip" type="fixed"><parent link="lower"/><child link="tool"/><origin xyz="0.1 0 -0.3" rpy="0 0.4 0"/></joint>
</robot>"""
PLACE = np.array([0.03, 0.01, -0.2])


def random_motion(body: MujocoBody) -> list[np.ndarray]:
    rng = np.random.default_rng(3)
    return [rng.normal(size=(6, count)) for count in (body.model.nq, body.model.nv, body.model.nv)]


def loaded(folder: Path, beside: str = "") -> Machine:
    (folder / "two.urdf").write_text(TWO_LINKS.replace("</robot>", TOOL))
    (folder / "two.yaml").write_text(
        f"body: {{urdf: two.urdf, contacts: false{beside}}}\njoints: {{one: {{}}, two: {{}}}}\n"
    )
    return Machine.load(folder / "two.yaml")


def test_a_centre_moves_the_mass_and_leaves_mass_and_inertia_about_it(tmp_path: Path):
    before = loaded(tmp_path).with_inertial({"lower.payload": 0.2})
    after = before.with_centre("lower", PLACE)
    own, known = after.body.own("lower"), before.body.own("lower")
    np.testing.assert_allclose(own.centre, PLACE)
    np.testing.assert_allclose(own.mass, known.mass)
    np.testing.assert_allclose(np.sort(own.moments), np.sort(known.moments), rtol=1e-6)
    assert after.body.parameters["lower.payload"] == pytest.approx(0.2)
    assert after.paths["two"].mass.value != before.paths["two"].mass.value
    motion = random_motion(before.body)
    columns = before.body.inertial_columns("lower", *motion) @ (own.ten - known.ten)
    np.testing.assert_allclose(after.body.inverse(*motion), before.body.inverse(*motion) + columns, atol=1e-9)


@pytest.mark.parametrize("suffix", [".yaml", ".xml", ".urdf"])
def test_a_centre_is_in_the_files_that_are_written(tmp_path: Path, suffix: str):
    machine = loaded(tmp_path).with_inertial({"lower.mass": 1.5}).with_centre("lower", PLACE)
    save_machine(machine, tmp_path / f"new{suffix}")
    again = (
        Machine.load(tmp_path / "new.yaml").body
        if suffix == ".yaml"
        else MujocoBody.load(tmp_path / f"new{suffix}", contacts=False)
    )
    motion = random_motion(again)
    np.testing.assert_allclose(again.inverse(*motion), machine.body.inverse(*motion), atol=1e-9)


def test_a_centre_of_a_link_that_does_not_exist_is_refused(tmp_path: Path):
    with pytest.raises(InputError, match=r"two.yaml.*has no link 'hand' that moves; those are upper, lower"):
        loaded(tmp_path, ", centres: {hand: [0, 0, 1]}")
