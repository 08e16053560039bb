"""Size, rate and power of the effort stay within their limits, whatever is commanded."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from rhythmid_nodes.effort_limits import EffortLimits

number = st.floats(-1e6, 1e6)
limit = st.floats(0.0, 1e6)


@given(number, number, limit, limit, limit, number, st.floats(1e-6, 1.0))
def test_whatever_is_commanded_size_and_power_keep_their_limits(
    effort, before, size, rate, power, speed, elapsed
):
    given_ = EffortLimits(size, rate, power).apply(effort, before, elapsed, speed)
    assert abs(given_) <= size and abs(given_ * speed) <= power * (1 + 1e-12)


@given(number, limit, limit, st.floats(1e-6, 1.0), st.floats(-1.0, 1.0))
def test_the_rate_keeps_its_limit(effort, size, rate, elapsed, share):
    before = share * size
    given_ = EffortLimits(size, rate).apply(effort, before, elapsed)
    assert abs(given_ - before) <= rate * elapsed * (1 + 1e-9) + 1e-9


@given(number)
def test_without_limits_the_effort_is_what_was_commanded(effort):
    assert EffortLimits().apply(effort, 0.0, 1e-3, math.nan) == effort


@pytest.mark.parametrize(("speed", "expected"), [(0.0, 5.0), (-4.0, 0.5), (math.nan, 0.0)])
def test_an_unknown_speed_leaves_no_power(speed, expected):
    assert EffortLimits(power=2.0).apply(5.0, 0.0, 1e-3, speed) == expected
