"""A payload of an arm that hardly moves: at each joint it looks like a constant force, at both together only like itself."""

from pathlib import Path

import numpy as np
import pytest
from legged import recorded, references, two_links

from rhythmid.body.machine import Machine
from rhythmid.diagnose.joints.joint_diagnosis import diagnose_machine
from rhythmid.elements.catalogue import load_catalogue

CARRIED = 0.1  # kg


@pytest.fixture
def arm(tmp_path: Path) -> Machine:
    return two_links(tmp_path)


def diagnosed(plant: Machine, nominal: Machine):
    time, rng = np.arange(0.0, 5.0, 0.002), np.random.default_rng(4)
    asked = references({"one": (0.5, 0.01), "two": (0.7, 0.01)}, time, rng, (0.3, 2.0))
    return diagnose_machine([recorded(plant, asked, time, rng)], nominal).diagnosis


def test_one_payload_is_named_in_the_place_of_a_constant_force_at_every_joint(arm: Machine):
    (one,) = diagnosed(arm.with_inertial({"lower.payload": CARRIED}), arm).missing
    assert (one.element, one.link, one.joint) == ("payload", "lower", "two")
    assert one.parameters["mass"].value == pytest.approx(CARRIED, rel=0.15)
    assert one.probability > 0.8


def test_constant_forces_that_no_payload_makes_stay_what_they_are(arm: Machine):
    constant = load_catalogue()["constant_force"]
    plant = arm.with_element("one", constant, {"force": 0.4}).with_element("two", constant, {"force": -0.3})
    found = diagnosed(plant, arm).missing
    assert {(one.joint, one.element) for one in found} == {
        ("one", "constant_force"),
        ("two", "constant_force"),
    }
