"""What all hypotheses of a joint share is computed once, with the same numbers as without this."""

from dataclasses import replace

import numpy as np
import pytest
from legged import fixed_leg, recorded, references
from scipy.signal import sosfiltfilt

from rhythmid.body import mujoco_body
from rhythmid.body.machine import Machine
from rhythmid.identify.inverse_dynamics.estimate import fit_effort, linearise
from rhythmid.identify.inverse_dynamics.motion import _both_ways, _sections
from rhythmid.identify.joints.joint_motion import JointBalances


@pytest.fixture(scope="module")
def balances(tmp_path_factory: pytest.TempPathFactory) -> JointBalances:
    machine = Machine.load(fixed_leg(tmp_path_factory.mktemp("leg")))
    time, rng = np.arange(0.0, 3.0, 0.002), np.random.default_rng(5)
    asked = references({"hip": (0.4, 0.3), "knee": (-1.2, 0.3)}, time, rng, (0.4, 3.0))
    return JointBalances.of(machine, [recorded(machine, asked, time, rng)])


@pytest.mark.parametrize("shape", [(40,), (900,), (900, 3)])
def test_the_filter_is_that_of_scipy_to_the_last_digit(shape):
    values = np.random.default_rng(0).standard_normal(shape)
    sections, at_rest = _sections(4, 0.07, "lowpass")
    for padding in (0, 20, 39):
        wanted = sosfiltfilt(sections, values, axis=0, padlen=padding)
        np.testing.assert_array_equal(_both_ways(sections, at_rest, values, padding), wanted)


def test_a_fit_of_which_all_is_the_same_is_not_made_again(balances: JointBalances):
    balance, model = balances.balance("hip"), balances.models["hip"]
    assert balances.balance("hip") is balance
    first = fit_effort(balance, model)
    assert fit_effort(balance, replace(model)) is first
    changed = model.with_values({"viscous_damper.damping": 1.1 * model.value("viscous_damper.damping")})
    assert fit_effort(balance, changed) is not first
    assert fit_effort(balance, model, alignment=0.001) is not first
    # a copy with other efforts has fits of its own
    other = replace(balance, measured=1.5 * balance.measured)
    assert fit_effort(other, model) is not first


def test_a_linearisation_filters_every_signal_once(balances: JointBalances, monkeypatch: pytest.MonkeyPatch):
    balance, model = balances.balance("hip"), balances.models["hip"]
    calls: list[int] = []
    given = type(balance).filtered
    monkeypatch.setattr(type(balance), "filtered", lambda self, *of: calls.append(1) or given(self, *of))
    linearise(balance, model, balance.estimated(model), 0.0)
    assert len(calls) == len(balance.motions)


def test_bodies_that_differ_in_inertias_share_the_forces_of_single_links(
    balances: JointBalances, monkeypatch: pytest.MonkeyPatch
):
    body, one = balances.machine.body, balances.bodies[0]
    assert isinstance(body, mujoco_body.MujocoBody)
    link = next(iter(body.links))
    motion = one.pose, one.rate, one.acceleration
    wanted = body.inertial_columns(link, *motion)
    heavier = body.with_parameters({f"{link}.mass": 2.0 * body.parameters[f"{link}.mass"]})
    calls: list[int] = []
    given = mujoco_body.MujocoBody._along
    monkeypatch.setattr(
        mujoco_body.MujocoBody, "_along", lambda self, *of: calls.append(1) or given(self, *of)
    )
    np.testing.assert_array_equal(heavier.inertial_columns(link, *(part.copy() for part in motion)), wanted)
    assert not calls
    tilted = body.with_gravity([1.0, 0.0, -9.0])
    assert not np.array_equal(tilted.inertial_columns(link, *motion), wanted) and calls
