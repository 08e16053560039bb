"""Lines in residuals are seen, coloured noise is not taken for one."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import lfilter

from machines import SHORT, hopper, records
from rhythmid.diagnose.line_test import strongest_line
from rhythmid.identify.output_error import estimate
from rhythmid.identify.series import prepare


@pytest.fixture(scope="module")
def fit():
    return estimate(hopper(), prepare(records(hopper(), SHORT[:2])))


def with_residuals(fit, make):
    return replace(fit, residuals=tuple(make(one) for one in fit.run.series))


def test_a_line_twice_the_noise_is_found_at_its_frequency(fit):
    rng = np.random.default_rng(1)
    line = strongest_line(
        with_residuals(
            fit, lambda s: rng.standard_normal(s.blocks) + 2.0 * np.sin(2 * np.pi * 3.7 * s.centres)
        )
    )
    assert line is not None
    assert line.frequency == pytest.approx(3.7, abs=0.1)
    assert line.p_value < 1e-12
    assert line.share > 0.4


@pytest.mark.parametrize("correlation", [0.0, 0.9])
def test_noise_white_or_coloured_is_no_line_in_thirty_of_thirty_draws(fit, correlation):
    for seed in range(30):
        rng = np.random.default_rng(seed)
        line = strongest_line(
            with_residuals(fit, lambda s: lfilter([1.0], [1.0, -correlation], rng.standard_normal(s.blocks)))  # noqa: B023
        )
        assert line is not None
        assert line.p_value > 1e-6 or line.share < 0.05
