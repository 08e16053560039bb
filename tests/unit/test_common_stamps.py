"""The efforts and positions of all joints have the stamps of one recorder."""

from pathlib import Path

import numpy as np
import pytest
from legged import recorded, references, two_links

from rhythmid.body.machine import Machine
from rhythmid.elements.catalogue import load_catalogue
from rhythmid.identify.inverse_dynamics.estimate import ALIGNED, fit_effort
from rhythmid.identify.joints.common_stamps import with_common_stamps
from rhythmid.identify.joints.joint_motion import JointBalances

LATE = 0.007  # [s]


@pytest.fixture
def arm(tmp_path: Path) -> Machine:
    return two_links(tmp_path, body=", step: 0.0005")


def balances_with(plant: Machine, nominal: Machine) -> JointBalances:
    time, rng = np.arange(0.0, 5.0, 0.002), np.random.default_rng(4)
    asked = references({"one": (0.5, 0.4), "two": (0.7, 0.4)}, time, rng, (0.3, 2.0))
    return JointBalances.of(nominal, [recorded(plant, asked, time, rng)])


def test_a_delay_of_one_joint_is_no_lag_beside_a_misalignment_that_the_other_joint_does_not_have(
    arm: Machine,
):
    known = load_catalogue()
    plant = arm.with_element("two", known["actuator_delay"], {"delay": LATE})
    plain = balances_with(plant, arm.with_element("two", known["actuator_lag"], {"time_constant": LATE}))
    common = with_common_stamps(plain)
    errors = {one: fit_effort(one.balance("two"), one.models["two"]).error for one in (plain, common)}
    assert errors[common] > 1.5 * errors[plain]


def test_a_joint_that_lacks_something_tells_nothing_of_the_stamps_of_the_other(arm: Machine):
    lag = load_catalogue()["actuator_lag"]
    balances = balances_with(arm.with_element("two", lag, {"time_constant": LATE}), arm)
    aligned = with_common_stamps(balances).aligned
    assert aligned["one"] == pytest.approx(ALIGNED * balances.period)
    assert aligned["two"] < 0.3 * ALIGNED * balances.period
