"""The step of a descent beside bounds: what ends at a bound leaves the others their own optimum."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rhythmid.identify.descent import _step

NONE = np.zeros(2, bool)


def test_what_would_leave_its_bounds_ends_there_and_the_others_are_solved_for_beside_it():
    jacobian = np.array([[1.0, 0.9], [0.0, 0.1], [0.3, 0.0]])
    residual = -jacobian @ [-1.0, 2.0]  # the free optimum
    step = _step(jacobian, residual, 0.0, NONE, np.array([-0.2, -9.0]), np.array([9.0, 9.0]))
    rest = residual + jacobian[:, 0] * -0.2
    assert step[0] == -0.2
    assert step[1] == pytest.approx(-float(jacobian[:, 1] @ rest) / float(jacobian[:, 1] @ jacobian[:, 1]))


def test_a_step_within_its_bounds_is_the_one_of_least_squares():
    rng = np.random.default_rng(0)
    jacobian, residual = rng.normal(size=(9, 2)), rng.normal(size=9)
    step = _step(jacobian, residual, 0.0, NONE, np.full(2, -np.inf), np.full(2, np.inf))
    np.testing.assert_allclose(step, -np.linalg.lstsq(jacobian, residual)[0])


def test_what_is_blocked_does_not_move():
    step = _step(np.eye(2), np.ones(2), 0.0, np.array([True, False]), np.full(2, -9.0), np.full(2, 9.0))
    np.testing.assert_allclose(step, [0.0, -1.0])


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 10_000))
def test_no_step_leaves_its_bounds_or_is_worse_than_one_that_is_cut_off(seed: int):
    rng = np.random.default_rng(seed)
    jacobian, residual = rng.normal(size=(12, 4)), rng.normal(size=12)
    least, most = -rng.uniform(0.0, 1.0, 4), rng.uniform(0.0, 1.0, 4)
    step = _step(jacobian, residual, 0.0, np.zeros(4, bool), least, most)
    assert np.all(step >= least) and np.all(step <= most)
    cut = np.clip(-np.linalg.lstsq(jacobian, residual)[0], least, most)
    first = cut == least
    if np.sum(first | (cut == most)) == 1:  # then the others are at their optimum beside it
        assert np.sum((residual + jacobian @ step) ** 2) <= np.sum((residual + jacobian @ cut) ** 2) + 1e-9
