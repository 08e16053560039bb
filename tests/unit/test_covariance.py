"""Covariance of a fit: the inverse information, what it says of undetermined directions, and parameters at a bound."""

from dataclasses import replace

import numpy as np
import pytest

from machines import hopper
from rhythmid.identify.covariance import EDGE, covariance_of, on_the_edge
from rhythmid.value import Prior

STANCE = "switched_damper.stance"


def test_the_covariance_is_the_inverse_information_whatever_the_units_of_the_parameters():
    jacobian = np.random.default_rng(1).standard_normal((50, 3)) * np.array([1e-8, 1.0, 1e6])
    expected = np.linalg.inv(jacobian.T @ jacobian)
    assert covariance_of(jacobian, [None] * 3) == pytest.approx(expected, rel=1e-6)


def test_a_prior_adds_its_information():
    jacobian = np.full((4, 1), 3.0)  # information 36
    assert covariance_of(jacobian, [Prior(0.0, 0.125)])[0, 0] == pytest.approx(1.0 / (36.0 + 64.0))


def test_only_parameters_that_take_part_in_an_undetermined_direction_are_undetermined():
    one, other = np.random.default_rng(2).standard_normal((2, 60))
    variances = np.diag(covariance_of(np.column_stack([one, one, other]), [None] * 3))
    assert variances[0] > 1e12 and variances[1] > 1e12
    assert variances[2] == pytest.approx(1.0 / (other @ other), rel=0.1)


@pytest.mark.parametrize(("distance", "found"), [(0.0, {}), (0.5 * EDGE, {STANCE: 0.0}), (2.0 * EDGE, {})])
def test_a_parameter_is_on_the_edge_when_its_distance_is_nothing_beside_its_uncertainty(distance, found):
    std = 3.0
    model = hopper().with_values({STANCE: distance * std})
    assert on_the_edge(model, [STANCE], np.array([[std**2]])) == found


def test_without_a_finite_bound_there_is_no_edge():
    stance = replace(hopper().parameters[STANCE], bounds=(-np.inf, np.inf), value=1e-9)
    assert on_the_edge(hopper().with_parameters({STANCE: stance}), [STANCE], np.eye(1)) == {}
