"""A parameter's standard deviation holds what the choice of the model adds to it."""

import numpy as np
import pytest

from rhythmid.diagnose.hypothesis import Hypothesis, Prediction
from rhythmid.diagnose.model_uncertainty import spread_of


def hypothesis(score: float, **values: float) -> Hypothesis:
    block = Prediction(np.array([score]), np.ones(1), np.ones(1))
    return Hypothesis(("coulomb_friction",), ("coulomb_friction",), "effects", 1, block, values=values)


def test_a_model_that_predicts_as_well_counts_as_much():
    chosen, rival = hypothesis(10.0, force=1.0), hypothesis(10.0, force=3.0)
    assert spread_of(chosen, [chosen, rival]) == {"force": pytest.approx(np.sqrt(2.0))}


def test_a_model_that_predicts_better_counts_wholly_and_a_worse_one_not_at_all():
    chosen, better, worse = (
        hypothesis(0.0, force=1.0),
        hypothesis(60.0, force=1.5),
        hypothesis(-60.0, force=9.0),
    )
    assert spread_of(chosen, [chosen, worse])["force"] == pytest.approx(0.0, abs=1e-9)
    assert spread_of(chosen, [chosen, better, worse])["force"] == pytest.approx(0.5)


def test_models_without_the_parameter_say_nothing_of_it():
    chosen, other = hypothesis(0.0, force=1.0), hypothesis(60.0, mass=2.0)
    assert spread_of(chosen, [chosen, other]) == {"force": 0.0}
