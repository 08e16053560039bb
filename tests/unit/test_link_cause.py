"""A change of a link is a body that can exist, and a cause only where the records contradict the file's link."""

from dataclasses import replace

import numpy as np
import pytest
from legged import recorded, references, two_links

from rhythmid.body.link_inertia import Principal
from rhythmid.body.machine import Machine
from rhythmid.diagnose.case import Budget
from rhythmid.diagnose.joints.joint_case import JointResult, diagnose_joint
from rhythmid.diagnose.joints.link_cause import LinkChange, columns_of, kinds_of, likely_link, ranked_changes
from rhythmid.elements.catalogue import Catalogue, load_catalogue
from rhythmid.identify.joints.joint_motion import JointBalances
from rhythmid.record.joint_record import JointRecord

Searched = tuple[JointBalances, list[JointRecord], dict[str, JointResult]]


@pytest.fixture(scope="module")
def arm(tmp_path_factory: pytest.TempPathFactory) -> Machine:
    return two_links(tmp_path_factory.mktemp("arm"))


def searched(plant: Machine, nominal: Machine, laws: tuple[str, ...] = ()) -> Searched:
    """The joints searched with a catalogue of these laws; a record of 4 s with noise of a torque sensor."""
    time, rng = np.arange(0.0, 4.0, 0.002), np.random.default_rng(4)
    record = recorded(
        plant, references({"one": (0.5, 0.4), "two": (0.7, 0.4)}, time, rng, (0.3, 2.0)), time, rng
    )
    record = replace(record, sampled="mean")
    balances, known = JointBalances.of(nominal, [record]), load_catalogue()
    catalogue = Catalogue({name: known[name] for name in ("viscous_damper", *laws)})
    found = {
        joint: diagnose_joint(balances, None, joint, catalogue, lambda _: None, Budget())
        for joint in nominal.joints
    }
    return balances, [record], found


def changes(arm: Machine, link: str) -> list[LinkChange]:
    balances, records, _ = searched(arm, arm)
    weights = columns_of(balances, link)
    return [LinkChange(balances, records, weights, link, kind) for kind in kinds_of(balances, link)]


def test_every_change_of_a_link_is_a_body_that_can_exist_and_acts_with_its_ten_numbers(arm: Machine):
    rng = np.random.default_rng(1)
    for change in changes(arm, "lower"):
        assert np.abs(change.coordinates(np.zeros(len(change.spreads)))).max() < 1e-9, change.kind
        for _ in range(20):
            numbers = np.maximum(rng.normal(size=len(change.spreads)) * change.spreads, change.least)
            assert Principal.from_ten(change.ten(numbers)).possible, change.kind
        placed = change.in_place(numbers, {})
        added = change.imposed(numbers, {})
        for joint in arm.joints:
            inertia = (
                placed.models[joint].mass.value - added.models[joint].mass.value
            )  # what the path has of the whole
            for after, before in zip(placed.motions[joint], added.motions[joint], strict=True):
                whole = after.coupling + inertia * after.acceleration
                np.testing.assert_allclose(whole, before.coupling, atol=1e-6 * np.ptp(before.coupling))


def test_a_hand_is_found_beside_a_friction_of_every_joint_of_which_a_single_joint_tells_neither(arm: Machine):
    known = load_catalogue()
    place = np.array([0.02, 0.0, -0.36])
    plant = arm.with_payload("lower", 0.8, place)
    for joint, force in (("one", 2.0), ("two", 1.0)):
        plant = plant.with_element(joint, known["coulomb_friction"], {"force": force, "transition": 0.03})
    balances, records, found = searched(plant, arm, ("coulomb_friction",))
    hand = likely_link(balances, records, found)
    assert hand is not None and hand.parameter == "lower.payload"
    assert hand.values["mass"].value == pytest.approx(0.8, abs=0.03)
    assert hand.values["z"].value == pytest.approx(place[2], abs=0.02)
    assert hand.probability > 0.9 and hand.share > 0.1
    assert hand.corrected.body.parameters["lower.payload"] == hand.values["mass"].value


def test_no_link_is_wrong_where_nothing_is_missing_and_where_every_joint_has_friction_only(arm: Machine):
    balances, records, found = searched(arm, arm)
    assert likely_link(balances, records, found) is None
    friction = load_catalogue()["coulomb_friction"]
    rough = arm.with_element("one", friction, {"force": 2.0, "transition": 0.03})
    rough = rough.with_element("two", friction, {"force": 1.0, "transition": 0.03})
    balances, records, found = searched(rough, arm, ("coulomb_friction",))
    assert likely_link(balances, records, found) is None


def test_a_wrong_mass_is_the_simplest_change_of_its_link_and_worth_more_than_one_of_another(arm: Machine):
    balances, records, found = searched(arm.with_inertial({"upper.mass": 3.0}), arm)
    ranked = ranked_changes(balances, records, found)
    assert (ranked[0].change.link, ranked[0].change.kind) == ("upper", "mass")
    rest = ranked_changes(balances, records, found, {"upper.mass"})
    assert rest and {one.change.link for one in rest} == {"lower"}


def test_joints_that_disagree_about_a_mass_are_no_evidence_for_it(arm: Machine):
    time, rng = np.arange(0.0, 4.0, 0.002), np.random.default_rng(4)
    record = recorded(
        arm, references({"one": (0.5, 0.4), "two": (0.7, 0.4)}, time, rng, (0.3, 2.0)), time, rng
    )
    two = record.joints["two"]
    louder = replace(two, effort=replace(two.effort, value=1.3 * two.effort.value))
    record = replace(record, sampled="mean", joints={**record.joints, "two": louder})
    balances = JointBalances.of(arm, [record])
    catalogue = Catalogue({"viscous_damper": load_catalogue()["viscous_damper"]})
    found = {
        joint: diagnose_joint(balances, None, joint, catalogue, lambda _: None, Budget())
        for joint in arm.joints
    }
    hand = likely_link(balances, [record], found, stated={"lower"})
    assert hand is None or "mass" not in hand.parameter.split(".")[1:], hand
