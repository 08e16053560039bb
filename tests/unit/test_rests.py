"""Rests where the effort is scored: what friction balances there is not known, and nothing of it comes into the errors beside."""

from dataclasses import replace
from functools import lru_cache

import numpy as np
import pytest
from axes import CATALOGUE, axis, axis_model

from rhythmid.commands.model_line import model_lines
from rhythmid.diagnose.answer.present_effort import effort_runs
from rhythmid.diagnose.effort.fitted import Fitted
from rhythmid.identify.inverse_dynamics.applicability import applicable
from rhythmid.identify.inverse_dynamics.balance import Balance
from rhythmid.identify.inverse_dynamics.estimate import fit_effort, variation_of
from rhythmid.identify.inverse_dynamics.rests import resting, told
from rhythmid.record.record import Channel, Record

RATE, LONG, FRICTION, NOISE = 250.0, 30.0, 0.8, 0.01  # [Hz], [s], [N], of the effort


def with_friction():
    return axis_model().with_element(CATALOGUE["coulomb_friction"], {"force": 0.3, "transition": 0.02})


@lru_cache
def stepped(dwell: float, jitter: float = 1e-5) -> Record:
    """An axis of 1 kg with 2 N s/m and Coulomb friction that moves by polynomials of least jerk and rests for about `dwell` [s] after
    each; what it balances meanwhile wanders within the friction. Positions have a noise of `jitter` [m]."""
    rng = np.random.default_rng(0)
    time = np.arange(round(LONG * RATE)) / RATE
    position, velocity, acceleration = np.zeros((3, len(time)))
    begins = dwell
    while begins < LONG:
        lasts, far = rng.uniform(0.35, 0.75), rng.uniform(0.05, 0.2) * rng.choice([-1.0, 1.0])
        s = np.clip((time - begins) / lasts, 0.0, 1.0)
        position += far * (10.0 * s**3 - 15.0 * s**4 + 6.0 * s**5)
        velocity += far / lasts * 30.0 * (s * (1.0 - s)) ** 2
        acceleration += far / lasts**2 * 60.0 * s * (1.0 - s) * (1.0 - 2.0 * s)
        begins += lasts + dwell * rng.uniform(0.6, 1.6)
    wanders = np.sin(4.0 * np.pi * np.cumsum(rng.uniform(0.05, 0.4, len(time))) / RATE)
    slides = acceleration + 2.0 * velocity + FRICTION * np.sign(velocity)
    effort = np.where(velocity == 0.0, FRICTION * wanders, slides)
    effort = effort + NOISE * effort.std() * rng.standard_normal(len(time))
    position = position + jitter * rng.standard_normal(len(time))
    return Record("steps", Channel(time, position, "m"), Channel(time, effort, "N"), hold="linear")


def test_a_long_rest_is_left_out_with_what_the_motion_s_filter_mixes_with_it():
    slow = np.zeros(100, bool)
    slow[40:60] = True
    slow[80:82] = True
    out = resting(slow, 10.0)
    assert out[35:65].all() and not out[34] and not out[65]
    assert out[80:82].all() and not out[79] and not out[82]


@pytest.mark.parametrize("dwell", [0.25, 0.6, 1.5])
def test_the_true_law_explains_the_effort_beside_rests_to_its_noise(dwell):
    balance = Balance.of([stepped(dwell)], axis_model())
    fit = fit_effort(balance, with_friction())
    filtered = NOISE * np.sqrt(2.0 * balance.bandwidth.effort / RATE)
    assert fit.error / variation_of(balance) < 1.2 * filtered
    assert fit.model.value("coulomb_friction.force") == pytest.approx(FRICTION, abs=0.003)
    assert fit.model.value("viscous_damper.damping") == pytest.approx(2.0, abs=0.01)


def test_what_the_motion_s_filter_mixes_with_a_rest_does_not_bias_the_friction():
    fit = fit_effort(Balance.of([stepped(0.6, 1e-4)], axis_model()), with_friction())
    assert fit.model.value("coulomb_friction.force") == pytest.approx(FRICTION, abs=0.004)


def test_no_more_is_left_out_than_the_rests_and_half_a_period_of_the_motion_s_filter_beside_them():
    record = stepped(0.25)
    balance = Balance.of([record], axis_model())
    motion = balance.motions[0]
    slow = np.abs(motion.leg_velocity) <= balance.stick_speed
    starts = np.flatnonzero(np.diff(slow.astype(int)))
    beside = len(starts) * 0.5 / (balance.bandwidth.motion * motion.period) / len(slow)
    assert balance.stuck < slow.mean() + 1.3 * beside


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("shift", [0.0, 0.0032])
def test_what_a_model_has_to_explain_is_the_same_whatever_the_effort_at_rest(seed, shift):
    balance = Balance.of([stepped(0.6)], axis_model())
    rng = np.random.default_rng(seed)
    (motion,), (rest,) = balance.motions, balance.rests
    size = 10.0 ** rng.uniform(-1.0, 3.0)
    effort = np.where(rest, size * rng.standard_normal(len(rest)), motion.effort)
    other = Balance.of_motions([replace(motion, effort=effort)], balance.bandwidth, balance.period)
    np.testing.assert_allclose(other.determined, balance.determined, rtol=1e-9, atol=1e-12)
    assert not np.allclose(other.measured, balance.measured, rtol=0.01)
    one, two = (b.predicted(with_friction(), shift) for b in (balance, other))
    np.testing.assert_array_equal(one, two)


def test_what_is_drawn_of_a_prediction_differs_from_the_recorded_effort_by_what_is_scored():
    balance = Balance.of([stepped(0.6)], axis_model())
    fit = fit_effort(balance, axis_model())
    (run,) = effort_runs(balance, Fitted.of((), "nominal", fit, {}), None, 1.0, ("", ""))
    np.testing.assert_allclose((run.before - run.measured)[run.used], fit.residual, atol=1e-9)


def test_the_share_that_is_left_out_is_told_where_it_is_of_practical_size():
    found = applicable([stepped(0.6)], axis_model())
    assert found.applies and found.balance is not None
    assert f"the machine rests at {found.balance.stuck:.0%} of the samples" in found.reason
    assert "rests" not in applicable([axis(amplitude=3.0)], axis_model()).reason
    assert told(0.02) is None


def test_a_check_of_records_with_a_model_tells_the_share_too(tmp_path):
    (tmp_path / "model.yaml").write_text(axis_model().to_yaml())
    lines = model_lines(tmp_path / "model.yaml", [stepped(0.6)])
    assert lines[-1].startswith("  note: were the effort scored: the machine rests at ")
    assert len(model_lines(tmp_path / "model.yaml", [axis(amplitude=3.0)])) == len(lines) - 1
