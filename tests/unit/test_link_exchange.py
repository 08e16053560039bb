"""Corrections of several links are fitted together: each with its value, none that stands for a part of another."""

from dataclasses import replace

import numpy as np
import pytest
from legged import recorded, references, two_links

from rhythmid.body.machine import Machine
from rhythmid.diagnose.answer.result import Estimate
from rhythmid.diagnose.case import Budget
from rhythmid.diagnose.joints import joint_diagnosis
from rhythmid.diagnose.joints.joint_case import diagnose_joint
from rhythmid.diagnose.joints.link_exchange import exchanged, exchanges
from rhythmid.diagnose.joints.wrong_link import WrongLink
from rhythmid.elements.catalogue import Catalogue, load_catalogue
from rhythmid.identify.joints.joint_motion import JointBalances


@pytest.fixture(scope="module")
def arm(tmp_path_factory: pytest.TempPathFactory) -> Machine:
    return two_links(tmp_path_factory.mktemp("arm"))


def finding(parameter: str, corrected: Machine) -> WrongLink:
    return WrongLink(parameter, {"mass": Estimate(1.0, 0.1, "kg")}, corrected, 0.95, 100.0, "two", 0.5)


def together(
    arm: Machine, masses: dict[str, float], *steps: tuple[str, Machine]
) -> dict[str, WrongLink] | None:
    """The corrections that were found in these steps for an arm with other masses, fitted together."""
    time, rng = np.arange(0.0, 4.0, 0.002), np.random.default_rng(4)
    moves = references({"one": (0.5, 0.4), "two": (0.7, 0.4)}, time, rng, (0.3, 2.0))
    records = [replace(recorded(arm.with_inertial(masses), moves, time, rng), sampled="mean")]
    given = JointBalances.of(arm, records)
    corrected = JointBalances.of(steps[-1][1], records, given)
    catalogue = Catalogue({"viscous_damper": load_catalogue()["viscous_damper"]})
    found = {
        joint: diagnose_joint(corrected, None, joint, catalogue, lambda _: None, Budget())
        for joint in arm.joints
    }
    return exchanged(given, records, found, {name: finding(name, machine) for name, machine in steps})


def test_a_centre_that_stood_for_a_mass_becomes_the_mass_and_all_values_are_right(arm: Machine):
    own = {name: arm.body.own(name) for name in ("upper", "lower")}
    masses = {"upper.mass": 1.1 * own["upper"].mass, "lower.mass": 1.08 * own["lower"].mass}
    first = arm.with_inertial({"upper.mass": 1.14 * own["upper"].mass})
    second = first.with_centre("lower", 1.07 * own["lower"].centre)
    made = together(arm, masses, ("upper.mass", first), ("lower.centre_of_mass", second))
    assert made is not None and set(made) == {"upper.mass", "lower.mass"}
    for name, mass in masses.items():
        value = made[name].values["mass"]
        assert value.std is not None and abs(value.value - mass) < 4.0 * value.std
        assert made[name].corrected.body.parameters[name] == pytest.approx(value.value)


def test_a_link_that_is_right_is_left_out(arm: Machine):
    mass = 1.1 * arm.body.own("lower").mass
    first = arm.with_inertial({"lower.mass": 1.09 * arm.body.own("lower").mass})
    second = first.with_centre("upper", arm.body.own("upper").centre + 0.003)
    made = together(arm, {"lower.mass": mass}, ("lower.mass", first), ("upper.centre_of_mass", second))
    assert made is not None and set(made) == {"lower.mass"}
    assert made["lower.mass"].values["mass"].value == pytest.approx(mass, rel=0.01)


def test_an_exchange_takes_a_change_away_or_puts_one_with_no_more_numbers_in_the_place_of_one():
    counts = {(link, kind): count for link in "abc" for kind, count in (("mass", 1), ("centre_of_mass", 3))}
    changes = {"a.mass": ("a", "mass"), "b.centre_of_mass": ("b", "centre_of_mass")}
    assert exchanges(changes, counts) == [
        {"b.centre_of_mass": ("b", "centre_of_mass")},
        {"a.mass": ("c", "mass"), "b.centre_of_mass": ("b", "centre_of_mass")},
        {"a.mass": ("a", "mass")},
        {"a.mass": ("a", "mass"), "b.centre_of_mass": ("b", "mass")},
        {"a.mass": ("a", "mass"), "b.centre_of_mass": ("c", "mass")},
        {"a.mass": ("a", "mass"), "b.centre_of_mass": ("c", "centre_of_mass")},
    ]
    alone = {"a.mass": ("a", "mass")}
    assert {} not in exchanges(alone, counts)


def test_a_diagnosis_fits_the_corrections_together_and_searches_the_joints_again(
    arm: Machine, monkeypatch: pytest.MonkeyPatch
):
    time, rng = np.arange(0.0, 4.0, 0.002), np.random.default_rng(4)
    moves = references({"one": (0.5, 0.4), "two": (0.7, 0.4)}, time, rng, (0.3, 2.0))
    own = {name: arm.body.own(name) for name in ("upper", "lower")}
    mass = 1.1 * own["lower"].mass
    record = replace(recorded(arm.with_inertial({"lower.mass": mass}), moves, time, rng), sampled="mean")
    first = arm.with_inertial({"upper.mass": 1.02 * own["upper"].mass})
    second = first.with_centre("lower", 1.08 * own["lower"].centre)
    one_by_one = iter([finding("upper.mass", first), finding("lower.centre_of_mass", second)])
    monkeypatch.setattr(joint_diagnosis, "likely_link", lambda *_: next(one_by_one, None))
    monkeypatch.setattr(joint_diagnosis, "likely_tilt", lambda *_: None)
    catalogue = Catalogue({"viscous_damper": load_catalogue()["viscous_damper"]})
    answer = joint_diagnosis.diagnose_machine([record], arm, catalogue=catalogue)
    (found,) = [one for one in answer.diagnosis.missing if one.link]
    assert (found.link, found.element) == ("lower", "link_mass")
    assert answer.machine.body.own("lower").mass == pytest.approx(mass, rel=0.01)
    assert answer.machine.body.own("upper").mass == own["upper"].mass
    assert answer.diagnosis.joints["one"].verdict == "consistent"
