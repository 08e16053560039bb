"""Masses of links that hardly move against each other are told together."""

from dataclasses import replace

import numpy as np
import pytest
from legged import recorded, references, two_links

from rhythmid.diagnose.answer.result import Estimate
from rhythmid.diagnose.case import Budget
from rhythmid.diagnose.joints.joint_answer import JointEffect
from rhythmid.diagnose.joints.joint_case import diagnose_joint
from rhythmid.diagnose.joints.link_group import carried, changes, masses_alike
from rhythmid.elements.catalogue import Catalogue, load_catalogue
from rhythmid.identify.joints.joint_motion import JointBalances

NOISE = 3.0  # N*m, a tenth of the effort


@pytest.fixture
def arm(tmp_path):
    return two_links(tmp_path, body=", free: {one.armature: {}}")


@pytest.mark.parametrize(("swing", "alike"), [(0.0005, True), (0.6, False)])
def test_the_mass_of_a_link_that_moves_almost_rigidly_with_the_one_it_carries_is_told_for_both_together(
    arm, swing, alike
):
    time, rng = np.arange(0.0, 6.0, 0.002), np.random.default_rng(4)
    plant = arm.with_inertial({"upper.mass": 3.0})
    record = recorded(
        plant, references({"one": (0.5, 0.4), "two": (0.0, swing)}, time, rng, (0.3, 2.0)), time, rng
    )
    one = record.joints["one"]
    noisy = replace(one.effort, value=one.effort.value + rng.normal(0.0, NOISE, len(one.effort.value)))
    record = replace(record, joints={**record.joints, "one": replace(one, effort=noisy)})
    balances = JointBalances.of(arm, [record])
    catalogue = Catalogue({"viscous_damper": load_catalogue()["viscous_damper"]})
    found = {"one": diagnose_joint(balances, None, "one", catalogue, lambda _: None, Budget())}
    assert carried(arm.body, "upper") == ("lower",) and carried(arm.body, "lower") == ()
    heavier = JointBalances.of(arm.with_inertial({"upper.mass": 3.0}), [record], balances)
    made = masses_alike(heavier, found, "upper.mass", Estimate(3.0, 0.05, "kg"), 2.0)
    assert (made is not None) == alike
    if made is not None:
        assert made.links == ("lower",) and made.given.value == pytest.approx(3.0)
        assert 3.0 < made.mass.value <= 4.0 and made.mass.std > 0.05


def test_collinear_masses_share_a_change_and_the_interval_of_their_sum_is_narrow_where_a_kilogram_on_each_does_the_same():
    one = np.random.default_rng(1).normal(size=1000)
    for worth, std in ((1.0, 0.03), (2.0, 0.71)):  # a kilogram farther out is worth two
        shares, covariance = changes(np.column_stack([one, worth * one]), 2.0)
        assert shares @ [1.0, worth] == pytest.approx(2.0, abs=0.01)
        assert np.sqrt(covariance.sum()) == pytest.approx(std, rel=0.1)
        assert np.sqrt(covariance[0, 0]) > 0.5  # kg, of which the records leave this open


def test_a_group_of_links_is_named():
    one = JointEffect(
        "one", "link_mass", "body", "m → m′", 0.9, 0.9, {}, 0.2, "upper", other_links=("lower",)
    )
    assert one.of_link == "mass of upper or of the links that it carries (lower), together"
