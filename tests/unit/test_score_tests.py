"""The screening of candidates: the line that a residual holds is found between the bins of its spectra."""

from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest

from rhythmid.diagnose.search.score_tests import residual_line
from rhythmid.identify.output_error import Fit
from rhythmid.identify.series import Series

PERIOD, BLOCK = 1e-3, 5


def fit_of(frequency: float, amplitude: float, *blocks: int) -> Fit:
    """A fit that leaves white noise of size one and a line in series of so many blocks."""
    rng = np.random.default_rng(5)
    made, residuals = [], []
    for count in blocks:
        time = PERIOD * np.arange(count * BLOCK)
        made.append(Series("made", time, time, None, None, BLOCK, np.ones(count, bool), PERIOD))
        phase = 2 * np.pi * (frequency * made[-1].centres + rng.uniform())
        residuals.append(amplitude * np.sin(phase) + rng.standard_normal(count))
    return cast(Fit, SimpleNamespace(run=SimpleNamespace(series=tuple(made)), residuals=tuple(residuals)))


@pytest.mark.parametrize("frequency", [3.7, 3.74, 3.7771, 11.113])
def test_a_line_between_bins_is_found_in_series_of_different_lengths(frequency):
    lengths = 700, 1000, 1613
    bin_width = 1.0 / (max(lengths) * BLOCK * PERIOD)
    assert residual_line(fit_of(frequency, 5.0, *lengths)) == pytest.approx(frequency, abs=0.03 * bin_width)


def test_a_line_too_faint_for_one_series_is_found_in_many():
    assert residual_line(fit_of(7.31, 0.3, *[800] * 12)) == pytest.approx(7.31, abs=0.02)


def test_too_short_or_silent_residuals_hold_no_line():
    assert residual_line(fit_of(7.31, 5.0, 8)) == 0.0
    quiet = fit_of(7.31, 5.0, 500)
    still = SimpleNamespace(run=quiet.run, residuals=(np.full(500, 0.1),))
    assert residual_line(cast(Fit, still)) == 0.0
