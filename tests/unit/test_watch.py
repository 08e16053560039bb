"""A machine is in danger when its measurements are late, old, frozen, full of gaps, no numbers, or beyond their limits."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from rhythmid_nodes.sample import Sample
from rhythmid_nodes.watch import Limits, Watch

S = 1_000_000_000
PERIOD = S // 200
EPOCH = 1_700_000_000 * S


def sample(stamp_ns, position=0.15, velocity=math.nan):
    return Sample(stamp_ns, position, velocity, math.nan)


def watched(limits, number=100, offset_ns=0):
    """A watch that has heard a swinging machine at 200 Hz, and the time of the newest measurement."""
    watch = Watch(limits)
    now = EPOCH
    for k in range(number):
        now = EPOCH + k * PERIOD
        watch.hear(sample(now - offset_ns, 0.15 + 0.01 * math.sin(0.1 * k)), now + S // 1000)
        assert watch.danger(now + S // 1000) == ""
    return watch, now


def test_before_the_first_measurement_nothing_may_be_done():
    assert "no measurement" in Watch(Limits()).danger(EPOCH)
    assert Watch(Limits(stale_after=0.0)).danger(EPOCH) == ""


def test_it_is_stale_by_arrival():
    watch, now = watched(Limits(stale_after=0.05))
    assert watch.danger(now + S // 25) == ""
    assert "0.060 s old" in watch.danger(now + S // 1000 + 6 * S // 100)


@pytest.mark.parametrize(("offset", "said"), [(-1, "ago"), (1, "ahead")])
def test_it_is_stale_by_its_stamp_though_it_keeps_coming(offset, said):
    watch, now = watched(Limits(stale_after=0.2))
    watch.hear(sample(now + PERIOD + offset * S), now + PERIOD)
    assert f"stamped 1.000 s {said}" in watch.danger(now + PERIOD)


def test_stamps_that_stand_still_grow_old():
    watch, now = watched(Limits(stale_after=0.05))
    for k in range(1, 8):
        watch.hear(sample(now, 0.15 + 0.001 * k), now + k * PERIOD)
        assert watch.danger(now + k * PERIOD) == ""
    watch.hear(sample(now, 0.2), now + 12 * PERIOD)
    assert "stamped 0.060 s ago" in watch.danger(now + 12 * PERIOD)


@pytest.mark.parametrize("offset", [-3600 * S, 55 * S])
def test_another_clock_may_be_anywhere_but_not_stand_still(offset):
    limits = Limits(stale_after=0.05, other_clock=True)
    watch, now = watched(limits, offset_ns=offset)
    watch.hear(sample(now - offset), now + 12 * PERIOD)
    assert "stamped 0.0" in watch.danger(now + 12 * PERIOD)


def test_another_clock_may_drift():
    watch = Watch(Limits(stale_after=0.05, other_clock=True))
    for k in range(20_000):
        now = EPOCH + k * S // 100
        watch.hear(sample(EPOCH + int(k * S // 100 * (1 - 2e-4)), k), now)
        assert watch.danger(now) == ""


@pytest.mark.parametrize("step", [0.06, -0.06])
def test_a_gap_in_the_stamps_is_seen(step):
    watch, now = watched(Limits(stale_after=0.5, gap=0.05))
    watch.hear(sample(now + round(step * S)), now + PERIOD)
    assert f"step by {step:.3f} s" in watch.danger(now + PERIOD)


def test_a_position_that_does_not_change_is_frozen():
    watch, now = watched(Limits(frozen_after=0.1))
    for k in range(1, 40):
        watch.hear(sample(now + k * PERIOD, 0.1234), now + k * PERIOD)
        assert bool(watch.danger(now + k * PERIOD)) == (k > 21)


@pytest.mark.parametrize("position", [math.nan, math.inf, 0.41, -0.01])
def test_a_position_outside_the_envelope_or_no_number_is_danger(position):
    watch, now = watched(Limits(low=0.0, high=0.4))
    watch.hear(sample(now + PERIOD, position), now + PERIOD)
    assert "outside the envelope" in watch.danger(now + PERIOD)


def test_without_an_envelope_no_number_is_danger_all_the_same():
    watch, now = watched(Limits())
    watch.hear(sample(now + PERIOD, math.nan), now + PERIOD)
    assert "outside the envelope" in watch.danger(now + PERIOD)


@pytest.mark.parametrize(("position", "velocity"), [(0.15, 3.5), (0.15, -3.5), (0.25, math.nan)])
def test_speed_is_told_or_taken_from_successive_positions(position, velocity):
    watch, now = watched(Limits(speed=3.0))
    watch.hear(sample(now + PERIOD, position, velocity), now + PERIOD)
    assert "exceeds 3 m/s" in watch.danger(now + PERIOD)


@given(st.lists(st.integers(-40, 40), min_size=2, max_size=60))
def test_jitter_below_the_limits_stops_nothing(jitter):
    watch = Watch(Limits(0.1, 0.0, 0.4, 3.0, 0.1))
    for k, milliseconds in enumerate(jitter):
        now = EPOCH + k * PERIOD
        arrived = now + 50 * S // 1000 + milliseconds * S // 1000
        watch.hear(sample(now, 0.15 + 0.001 * (k % 2)), arrived)
        assert watch.danger(arrived) == ""
