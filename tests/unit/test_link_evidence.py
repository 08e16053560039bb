"""A value of a link that one joint finds is judged by the evidence of all joints that it moves."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from legged import TWO_LINKS, recorded, references, two_links

from rhythmid.body.machine import Machine
from rhythmid.diagnose.effort.candidate import fixed_values
from rhythmid.diagnose.joints.joint_answer import MachineDiagnosis
from rhythmid.diagnose.joints.joint_diagnosis import diagnose_machine
from rhythmid.elements.catalogue import Catalogue, load_catalogue
from rhythmid.identify.joints.joint_motion import JointBalances
from rhythmid.record.joint_record import JointRecord

CENTRE, FARTHER = "0 0.02 -0.15", "0 0.02 -0.23"  # of the lower link, in its frame [m]


@pytest.fixture
def arm(tmp_path: Path) -> Callable[[str], Machine]:
    def made(centre: str) -> Machine:
        return two_links(tmp_path, TWO_LINKS.replace(CENTRE, centre))

    return made


def run(plant: Machine) -> JointRecord:
    time, rng = np.arange(0.0, 6.0, 0.002), np.random.default_rng(4)
    return recorded(
        plant, references({"one": (0.5, 0.4), "two": (0.7, 0.4)}, time, rng, (0.3, 2.0)), time, rng
    )


def diagnosed(plant: Machine, nominal: Machine) -> MachineDiagnosis:
    return diagnose_machine([run(plant)], nominal).diagnosis


def test_a_wrong_centre_of_mass_is_named_and_not_a_mass_or_a_payload(arm: Callable[[str], Machine]):
    found = diagnosed(arm(FARTHER), arm(CENTRE))
    first = found.missing[0]
    assert (first.element, first.link, first.joint) == ("link_centre_of_mass", "lower", "two")
    assert first.parameters["z"].value == pytest.approx(-0.23, abs=0.003)
    assert [one.element for one in found.missing if one.link] == ["link_centre_of_mass"]
    assert "the centre of mass of lower" in found.summary
    assert any(
        "lower.centre_of_mass: (0, 0.02, -0.15) m in the nominal model" in note for note in found.notes
    )


def test_a_load_that_is_heavier_and_farther_out_is_told_with_its_mass_and_its_centre_and_no_gain_beside_it(
    arm: Callable[[str], Machine],
):
    known = load_catalogue()
    few = Catalogue({name: known[name] for name in ("viscous_damper", "coulomb_friction", "actuator_gain")})
    plant = arm(FARTHER).with_inertial({"lower.mass": 3.0})
    answer = diagnose_machine([run(plant)], arm(CENTRE), catalogue=few)
    (one,) = answer.diagnosis.missing
    assert (one.element, one.link, one.joint) == ("link_mass_and_centre", "lower", "two")
    assert one.parameters["mass"].value == pytest.approx(3.0, abs=0.05)
    assert one.parameters["z"].value == pytest.approx(-0.23, abs=0.005)
    assert one.parameters["first_moment"].value == pytest.approx(3.0 * np.hypot(0.02, 0.23), rel=0.01)
    assert answer.machine.body.parameters["lower.mass"] == pytest.approx(3.0, abs=0.05)
    assert "the mass and centre of lower" in answer.diagnosis.summary


@pytest.mark.long  # test_link_mass finds a mass, and the tests above and below one beside a gain and a load
def test_a_mass_is_found_with_its_value_though_the_joint_above_has_a_friction(tmp_path: Path):
    nominal = two_links(tmp_path, body=", step: 0.0005")
    heavier = nominal.with_inertial({"lower.mass": 1.4}).with_element(
        "one", load_catalogue()["coulomb_friction"], {"force": 4.0, "transition": 0.03}
    )
    found = diagnosed(heavier, nominal)
    assert {(one.joint, one.element) for one in found.missing} == {
        ("two", "link_mass"),
        ("one", "coulomb_friction"),
    }
    (mass,) = [one for one in found.missing if one.link]
    assert (mass.element, mass.link) == ("link_mass", "lower")
    assert mass.parameters["mass"].value == pytest.approx(1.4, abs=0.01)


def test_a_mass_that_stands_for_a_gain_of_its_joint_is_refuted_by_the_joint_above_and_taken_back(
    arm: Callable[[str], Machine],
):
    nominal = arm(CENTRE)
    record = run(nominal)
    two = record.joints["two"]
    louder = replace(two, effort=replace(two.effort, value=1.3 * two.effort.value))
    known = load_catalogue()  # without the gain of an actuator, which would explain it
    few = Catalogue({name: known[name] for name in ("viscous_damper", "coulomb_friction")})
    said: list[str] = []
    answer = diagnose_machine(
        [replace(record, joints={**record.joints, "two": louder})], nominal, catalogue=few, tell=said.append
    )
    assert "lower.mass of two is refuted by the joints that it moves" in said
    # only the joint that has found the mass is searched again, without it
    assert [one for one in said if one.startswith("joint ")] == ["joint one", "joint two", "joint two"]
    assert not {one.element for one in answer.diagnosis.missing} & {"link_mass", "payload"}
    assert answer.diagnosis.joints["one"].verdict == "consistent"
    assert answer.machine.body.parameters["lower.mass"] == pytest.approx(1.0)


def test_a_value_that_the_joints_refute_is_no_candidate_where_it_was_found(arm: Callable[[str], Machine]):
    nominal = arm(CENTRE)
    record = run(nominal)
    balances = JointBalances.of(nominal, [record])
    without = JointBalances.of(nominal, [record], balances.without("two", "lower.mass"))
    for joint, expected in (("one", True), ("two", False)):
        names = fixed_values(without.balance(joint), without.models[joint])
        assert ("body.lower.mass" in names) is expected
        assert "lower.mass" in without.links(joint)  # it is still judged there
