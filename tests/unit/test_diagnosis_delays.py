"""Delays as a diagnosis gives them: what the records do not determine has no standard deviation."""

from dataclasses import replace
from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest

from machines import hopper
from rhythmid.diagnose.delays import delays_of
from rhythmid.identify.output_error import Fit
from rhythmid.value import Prior

NAMES = ("input_delay.delay", "measurement_delay.delay")


def fit_with(covariance: list[list[float]]) -> Fit:
    """A fit of both delays, 20 and 15 ms, with this covariance [s²]."""
    given = np.array(covariance)
    std = dict(zip(NAMES, np.sqrt(np.diag(given)).tolist()))
    model = hopper().with_values(dict(zip(NAMES, (0.02, 0.015))))
    run = SimpleNamespace(series=())
    return cast(Fit, SimpleNamespace(model=model, names=NAMES, std=std, covariance=given, run=run))


def test_delays_that_nothing_determines_have_no_standard_deviation():
    found = delays_of(fit_with([[np.inf, -np.inf], [-np.inf, np.inf]]))
    assert found["input"] == {"value": 0.02, "std": None, "unit": "s"}
    assert found["measurement"] == {"value": 0.015, "std": None, "unit": "s"}
    assert found["sum"] == {"value": pytest.approx(0.035), "std": None, "unit": "s"}
    assert found["separable"] is False


def test_a_delay_that_only_repeats_its_prior_is_not_determined():
    fit = fit_with([[4e-4, 0.0], [0.0, 9e-8]])
    prior = Prior(0.0, 0.02)
    late = {name: replace(fit.model.parameters[name], prior=prior) for name in NAMES}
    found = delays_of(cast(Fit, SimpleNamespace(**vars(fit) | {"model": fit.model.with_parameters(late)})))
    assert (found["input"]["std"], found["measurement"]["std"]) == (None, pytest.approx(3e-4))


def test_delays_that_are_determined_have_theirs_and_their_sum_s():
    found = delays_of(fit_with([[4e-8, -2e-8], [-2e-8, 9e-8]]))
    assert [found[key]["std"] for key in ("input", "measurement", "sum")] == pytest.approx([2e-4, 3e-4, 3e-4])
    assert found["separable"] is True


def test_delays_of_which_only_the_sum_is_known_are_not_separable():
    found = delays_of(fit_with([[1e-4, -0.99999e-4], [-0.99999e-4, 1e-4]]))
    assert found["sum"]["std"] == pytest.approx(np.sqrt(2e-9))
    assert found["separable"] is False


def test_a_model_with_one_delay_says_that_it_stands_for_both():
    fit = fit_with([[4e-8, 0.0], [0.0, 9e-8]])
    changed = {
        "model": fit.model.without("measurement_delay"),
        "names": NAMES[:1],
        "run": SimpleNamespace(series=(SimpleNamespace(forcing=object()),)),
    }
    found = delays_of(cast(Fit, SimpleNamespace(**vars(fit) | changed)))
    assert found["assumption"] == "the model has one delay, which stands for both"
    assert found["separable"] is False and found["sum"] == found["input"]
