"""Structures to refit: records that the model does not follow, and their weight."""

from dataclasses import replace
from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest

from rhythmid.diagnose.search.proposals import follows_all, levelled
from rhythmid.identify.output_error import Fit
from rhythmid.identify.series import Series

PERIOD, COUNT = 0.01, 200


def fit_of(*records: tuple[str, float, float]) -> Fit:
    """A fit to stretches of records: name of the record, size of its motion, and size of its residual."""
    rng = np.random.default_rng(2)
    time = PERIOD * np.arange(COUNT)
    made, residuals = [], []
    for number, (record, size, left) in enumerate(records):
        motion = size * rng.standard_normal(COUNT)
        one = Series(f"{record}@{number}", time, motion, None, None, 1, np.ones(COUNT, bool), PERIOD)
        made.append(replace(one, record=record))
        residuals.append(left * rng.standard_normal(COUNT))
    return cast(Fit, SimpleNamespace(run=SimpleNamespace(series=tuple(made)), residuals=tuple(residuals)))


def test_a_small_motion_that_the_model_misses_is_not_hidden_by_a_large_one_that_it_follows():
    assert follows_all(fit_of(("large", 1.0, 0.1), ("small", 0.01, 0.001)))
    assert not follows_all(fit_of(("large", 1.0, 0.1), ("small", 0.01, 0.008)))


def test_every_record_counts_alike_once_its_residual_is_levelled():
    fit = fit_of(("large", 1.0, 0.1), ("small", 0.01, 0.008), ("large", 1.0, 0.1))
    sizes = [
        np.std(one.levelled(residual)) for residual, one in zip(fit.residuals, levelled(fit), strict=True)
    ]
    assert sizes == pytest.approx([sizes[0]] * 3, rel=0.2)
