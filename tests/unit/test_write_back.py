"""Identified values back in MJCF and URDF."""

from importlib.resources import files
from pathlib import Path

import mujoco
import numpy as np
import pytest

from rhythmid.body.machine import Machine
from rhythmid.body.mujoco_body import MujocoBody
from rhythmid.body.write_back import save_machine
from rhythmid.elements.catalogue import load_catalogue
from rhythmid.errors import InputError

LEG = Path(str(files("rhythmid"))) / "models" / "legs" / "leg.yaml"
URDF = """<robot name="arm"><link name="world"/>
<link name="upper"><inertial><origin xyz="0 0 -0.1"/><mass value="1.0"/>
<inertia ixx="0.01" iyy="0.01" izz="0.001" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="shoulder" type="continuous"><parent link="world"/><child link="upper"/><axis xyz="0 1 0"/></joint></robot>
"""


def identified() -> Machine:
    machine = Machine.load(LEG).with_inertial({"shank.mass": 0.3, "knee.armature": 0.011})
    machine = machine.with_values({"knee.viscous_damper.damping": 0.07})
    return machine.with_element(
        "knee", load_catalogue()["coulomb_friction"], {"force": 0.25, "transition": 0.02}
    )


def test_mjcf_holds_what_was_identified_and_names_what_it_cannot_express(tmp_path: Path):
    left = save_machine(identified(), tmp_path / "leg.xml")
    assert left == ()
    lagging = identified().with_element("hip", load_catalogue()["actuator_lag"], {"time_constant": 0.01})
    assert [line[:26] for line in save_machine(lagging, tmp_path / "lag.xml")] == [
        "hip: not expressed: actuat"
    ]
    model = mujoco.MjModel.from_xml_path(str(tmp_path / "leg.xml"))
    knee = int(model.joint("knee").dofadr[0])
    assert model.body("shank").mass[0] == pytest.approx(0.3)
    assert model.dof_armature[knee] == pytest.approx(0.011)
    assert model.dof_damping[knee] == pytest.approx(0.07)
    assert model.dof_frictionloss[knee] == pytest.approx(0.25)
    again = MujocoBody.load(tmp_path / "leg.xml", "rail")
    np.testing.assert_allclose(
        again.inertial("shank"), identified().body.inertial("shank"), rtol=1e-12, atol=1e-15
    )


def test_urdf_is_read_and_written_back(tmp_path: Path):
    (tmp_path / "arm.urdf").write_text(URDF)
    (tmp_path / "arm.yaml").write_text(
        "body: {urdf: arm.urdf}\njoints: {shoulder: {force: [{viscous_damper: {damping: 0.4}}]}}\n"
    )
    machine = Machine.load(tmp_path / "arm.yaml").with_inertial({"upper.mass": 1.5})
    save_machine(machine, tmp_path / "better.urdf")
    again = MujocoBody.load(tmp_path / "better.urdf")
    assert again.parameters["upper.mass"] == pytest.approx(1.5)
    assert again.passive["shoulder"].damping == pytest.approx(0.4)
    np.testing.assert_allclose(again.inertial("upper"), machine.body.inertial("upper"), rtol=1e-6)
    save_machine(machine, tmp_path / "better.xml")
    as_mjcf = MujocoBody.load(tmp_path / "better.xml")
    np.testing.assert_allclose(as_mjcf.inertial("upper"), machine.body.inertial("upper"), rtol=1e-6)
    with pytest.raises(InputError, match="is no URDF"):
        save_machine(identified(), tmp_path / "leg.urdf")
