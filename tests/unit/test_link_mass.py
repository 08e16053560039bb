"""A link whose mass is wrong, found by the joints that carry it."""

import numpy as np
import pytest
from legged import MODELS, hop, recorded

from rhythmid.body.machine import Machine
from rhythmid.diagnose.joints.joint_diagnosis import diagnose_machine
from rhythmid.elements.catalogue import Catalogue, load_catalogue

LAWS = ("viscous_damper", "coulomb_friction", "constant_force", "actuator_gain", "linear_spring")


def test_a_links_wrong_mass_has_the_share_and_the_probability_that_the_evidence_gives_it():
    machine = Machine.load(MODELS / "leg.yaml")
    heavier = machine.with_inertial({"shank.mass": 1.5 * machine.body.parameters["shank.mass"]})
    time, rng = np.arange(0.0, 4.0, 0.002), np.random.default_rng(1)
    record = recorded(heavier, hop(time, rng), time, rng)
    known = load_catalogue()
    few = Catalogue({name: known[name] for name in LAWS})
    found = diagnose_machine([record], machine, catalogue=few).diagnosis
    (one,) = [effect for effect in found.missing if effect.element == "link_mass"]
    assert one.link == "shank" and one.joint == "knee"
    assert one.parameters["mass"].value == pytest.approx(heavier.body.parameters["shank.mass"], rel=0.1)
    assert 0.05 < one.share <= 1.0 and 0.3 < one.probability < 1.0, (one.share, one.probability)
    assert one.heldout_gain > 0.05


@pytest.mark.long
def test_a_links_wrong_mass_has_only_its_part_of_the_mismatch_beside_a_friction():
    machine = Machine.load(MODELS / "leg.yaml")
    rough = machine.with_inertial({"shank.mass": 1.5 * machine.body.parameters["shank.mass"]}).with_element(
        "hip", load_catalogue()["coulomb_friction"], {"force": 0.5, "transition": 0.03}
    )
    time, rng = np.arange(0.0, 8.0, 0.002), np.random.default_rng(1)
    found = diagnose_machine([recorded(rough, hop(time, rng), time, rng)], machine).diagnosis
    share = {(effect.joint, effect.element): effect.share for effect in found.missing}
    assert 0.05 < share["knee", "link_mass"] < 1.0 and share["hip", "coulomb_friction"] > 0.05, share
