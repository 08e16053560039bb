"""What the records of a joint do not separate: a link that turns about one fixed axis is felt as the rotor is."""

from pathlib import Path

import numpy as np
from legged import recorded, references

from rhythmid.body.machine import Machine
from rhythmid.diagnose.joints.joint_diagnosis import diagnose_machine

TURNTABLE = """<robot name="turntable">
  <link name="base"/>
  <link name="table"><inertial><origin xyz="0.1 0 0"/><mass value="2"/>
    <inertia ixx="0.01" iyy="0.01" izz="0.02" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <joint name="turn" type="revolute"><parent link="base"/><child link="table"/><axis xyz="0 0 1"/>
    <limit lower="-3" upper="3" effort="50" velocity="10"/></joint>
</robot>
"""
PATH = (
    "{command: [{input_delay: {delay: 0.0}}, {position_control: {proportional: {value: 40, fixed: true}, "
    "derivative: {value: 1.0, fixed: true}}}], force: [{viscous_damper: {damping: {value: 0.5, fixed: true}}}]}"
)


def written(folder: Path) -> Machine:
    (folder / "table.urdf").write_text(TURNTABLE)
    (folder / "table.yaml").write_text(
        f"body: {{urdf: table.urdf, contacts: false}}\njoints: {{turn: {PATH}}}\n"
    )
    return Machine.load(folder / "table.yaml")


def test_a_heavier_link_about_a_vertical_axis_is_named_as_the_rotor_and_shares_its_probability(
    tmp_path: Path,
):
    machine = written(tmp_path)
    heavier = machine.with_inertial({"table.mass": 2.8})
    time, rng = np.arange(0.0, 6.0, 0.002), np.random.default_rng(5)
    asked = references({"turn": (0.0, 0.4)}, time, rng, (0.3, 3.0))
    found = diagnose_machine([recorded(heavier, asked, time, rng)], machine).diagnosis
    (one,) = found.missing
    assert (one.joint, one.element) == ("turn", "armature")
    assert set(found.indistinguishable[0]) >= {
        "turn: armature",
        "turn: link_mass",
        "turn: link_inertia",
        "turn: payload",
    }
    assert one.probability < 0.3  # of one of four names
    assert "turn: armature or " in found.summary
