"""A parameter's standard deviation holds what the choice of the model adds to it."""

from dataclasses import replace

import numpy as np
import pytest

from rhythmid.diagnose.hypothesis import Hypothesis, Prediction
from rhythmid.diagnose.model_uncertainty import covariance_between, std_among


def hypothesis(score: float, **values: float) -> Hypothesis:
    block = Prediction(np.array([score]), np.ones(1), np.ones(1))
    return Hypothesis(("coulomb_friction",), ("coulomb_friction",), "effects", 1, block, values=values)


def spread(chosen: Hypothesis, *others: Hypothesis) -> float:
    return float(np.sqrt(covariance_between(["force"], chosen, [chosen, *others])[0, 0]))


def test_a_model_that_predicts_as_well_counts_as_much():
    assert spread(hypothesis(10.0, force=1.0), hypothesis(10.0, force=3.0)) == pytest.approx(np.sqrt(2.0))


def test_a_model_that_predicts_better_counts_wholly_and_a_worse_one_not_at_all():
    chosen, better, worse = (
        hypothesis(0.0, force=1.0),
        hypothesis(60.0, force=1.5),
        hypothesis(-60.0, force=9.0),
    )
    assert spread(chosen, worse) == pytest.approx(0.0, abs=1e-9)
    assert spread(chosen, better, worse) == pytest.approx(0.5)


def test_models_without_the_parameter_say_nothing_of_it():
    assert spread(hypothesis(0.0, force=1.0), hypothesis(60.0, mass=2.0)) == 0.0


def test_parameters_that_depart_together_leave_what_they_share_certain():
    chosen, other = hypothesis(0.0, input=0.02, output=0.03), hypothesis(0.0, input=0.03, output=0.02)
    between = covariance_between(["input", "output", "mass"], chosen, [chosen, other])
    assert between[0, 0] > 0.0
    assert np.array([1.0, 1.0, 0.0]) @ between @ np.array([1.0, 1.0, 0.0]) == pytest.approx(0.0, abs=1e-12)
    np.testing.assert_array_equal(between[2], 0.0)


def test_the_size_of_an_effect_is_open_where_hypotheses_that_share_the_evidence_disagree_on_it():
    chosen = replace(hypothesis(0.0, force=8.0), elements=("friction", "lag"))
    other = replace(hypothesis(0.0, force=2.0), elements=("friction", "mode"))
    richer = replace(hypothesis(60.0, force=80.0), elements=("friction", "lag", "mode"))
    weights = {chosen.key: 0.75, other.key: 0.25}  # richer hypotheses that were not accepted have none
    found = std_among({"force": 4.0}, chosen, [chosen, other, richer], weights)
    assert found == pytest.approx({"force": 5.0})
    assert std_among({"force": 4.0}, chosen, [chosen, richer], {chosen.key: 1.0}) == {"force": 4.0}
