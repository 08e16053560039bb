"""The part of an error of effort that lasts: what comes from something that the model lacks, and not what a filter makes of noise."""

import numpy as np
import pytest
from scipy.signal import firwin, lfilter

from rhythmid.diagnose.effort.run import PAST, lasting_share
from rhythmid.diagnose.effort.search import GAP

ROWS = 1200
RECORD = np.repeat([0, 1, 2], ROWS // 3)


def white(seed):
    return np.random.default_rng(seed).standard_normal(ROWS)


@pytest.mark.parametrize("seed", range(8))
def test_noise_and_what_the_filter_makes_of_it_do_not_last(seed):
    filtered = lfilter(firwin(GAP, 0.8), 1.0, white(seed))
    assert lasting_share(white(seed), RECORD, GAP) < 0.15
    assert lasting_share(filtered, RECORD, GAP) < 0.15


def test_an_error_that_swings_slowly_lasts_with_its_share():
    swing = np.sin(2.0 * np.pi * np.arange(ROWS) / 40.0)
    assert lasting_share(swing, RECORD, GAP) > 0.99
    mixed = swing + white(1) * np.sqrt(0.5)  # half of the power
    assert lasting_share(mixed, RECORD, GAP) == pytest.approx(0.6, abs=0.15)


def test_without_error_or_with_few_rows_nothing_lasts():
    assert lasting_share(np.zeros(ROWS), RECORD, GAP) == 0.0
    assert lasting_share(white(2)[:PAST], RECORD[:PAST], GAP) == 0.0
