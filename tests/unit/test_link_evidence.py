"""A value of a link that one joint finds is judged by the evidence of all joints that it moves."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from legged import TWO_LINKS, recorded, references

from rhythmid.body.machine import Machine
from rhythmid.diagnose.joints.joint_answer import MachineDiagnosis
from rhythmid.diagnose.joints.joint_diagnosis import diagnose_machine
from rhythmid.elements.catalogue import load_catalogue

PATH = (
    "{command: [{input_delay: {delay: 0.0}}, {position_control: {proportional: {value: 80, fixed: true}, "
    "derivative: {value: 2.0, fixed: true}}}], force: [{viscous_damper: {damping: 0.1}}]}"
)
CENTRE, FARTHER = "0 0.02 -0.15", "0 0.02 -0.23"  # of the lower link, in its frame [m]


@pytest.fixture
def arm(tmp_path: Path) -> Callable[[str], Machine]:
    def made(centre: str) -> Machine:
        (tmp_path / "two.urdf").write_text(TWO_LINKS.replace(CENTRE, centre))
        (tmp_path / "two.yaml").write_text(
            f"body: {{urdf: two.urdf, contacts: false}}\njoints:\n  one: {PATH}\n  two: {PATH}\n"
        )
        return Machine.load(tmp_path / "two.yaml")

    return made


def diagnosed(plant: Machine, nominal: Machine) -> MachineDiagnosis:
    time, rng = np.arange(0.0, 6.0, 0.002), np.random.default_rng(4)
    asked = references({"one": (0.5, 0.4), "two": (0.7, 0.4)}, time, rng, (0.3, 2.0))
    return diagnose_machine([recorded(plant, asked, time, rng)], nominal).diagnosis


def test_a_mass_that_the_joint_above_refutes_is_not_named(arm):
    found = diagnosed(arm(FARTHER), arm(CENTRE))
    print(found.summary, found.missing, found.notes)
    masses = [
        one for one in found.missing if one.element in ("link_mass", "payload") and one.probability > 0.8
    ]
    assert not masses


def test_a_mass_is_found_with_its_value_though_the_joint_above_has_a_friction(arm):
    nominal = arm(CENTRE)
    heavier = nominal.with_inertial({"lower.mass": 1.4}).with_element(
        "one", load_catalogue()["coulomb_friction"], {"force": 0.5, "transition": 0.03}
    )
    found = diagnosed(heavier, nominal)
    print(found.summary, found.missing, found.notes)
    assert {(one.joint, one.element) for one in found.missing} == {
        ("two", "link_mass"),
        ("one", "coulomb_friction"),
    }
    (mass,) = [one for one in found.missing if one.element == "link_mass"]
    assert mass.parameters["mass"].value == pytest.approx(1.4, abs=0.05)
