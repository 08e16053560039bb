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


@pytest.mark.parametrize("seen", [0.0, 1e-14])
def test_a_prior_of_what_the_records_do_not_show_leaves_the_others_as_uncertain_as_they_are(seen):
    rng = np.random.default_rng(5)
    others = rng.standard_normal((50, 2)) * [40.0, 5000.0]
    jacobian = np.column_stack([others, np.full(50, seen)])
    found = covariance_of(jacobian, [None, None, Prior(0.0, 0.02)])
    assert found[:2, :2] == pytest.approx(covariance_of(others, [None, None]), rel=1e-9)
    assert found[2, 2] == pytest.approx(0.02**2)


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


def test_what_cannot_be_told_apart_leaves_the_precision_of_a_parameter_that_can():
    # a spring that a pendulum's gravity has replaced: stiffness, rest length, damping, moment and angle at rest. The first two do the same
    # but for rounding, in which the moment takes part
    rows = np.array(
        [
            [-1.0, -0.999999993, -0.028486618, 0.153789044, -0.993643291],
            [0.0, 1.14247e-4, 0.016475255, -0.987087372, -0.001026969],
            [0.0, 0.0, -0.999458393, 8.45446e-4, 0.020954075],
            [0.0, 0.0, 0.0, 0.04479659, -0.011640629],
            [0.0, 0.0, 0.0, 0.0, 0.109988078],
        ]
    )
    std = np.sqrt(np.diag(covariance_of(rows, [None] * 5)))
    assert (std[:2] > 1e10).all()
    assert std[2:] == pytest.approx([1.0, 1.0, 9.0], rel=0.05)
