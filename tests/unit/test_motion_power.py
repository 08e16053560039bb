"""What the errors of a part of a record are a share of."""

from dataclasses import replace

import numpy as np
import pytest

from rhythmid.identify.output_error import normalised_error
from rhythmid.identify.series import Series, hold_out_tail
from rhythmid.motion_power import motion_power
from rhythmid.report.run import Run, error_of

STEP = 0.01
COUNT = 1e-3  # of an encoder


def released() -> Series:
    """A free decay that has come to rest in half of the record, as an encoder counts it."""
    time = STEP * np.arange(2000)
    size = 0.1 * np.maximum(1.0 - time / 10.0, 0.0)
    value = COUNT * np.round(size * np.cos(5.0 * time) / COUNT)
    return Series("released", time, value, None, None, 1, np.ones(2000, bool), STEP)


def test_an_error_of_one_count_where_a_machine_has_come_to_rest_is_small():
    (one,), (tail,) = hold_out_tail([released()])
    residual = [np.full(one.blocks, COUNT)]
    share = COUNT / np.std(one.averaged)
    assert normalised_error(residual, [one], hidden=True) == pytest.approx(share)
    assert normalised_error(residual, [tail]) == pytest.approx(share)
    assert share < 0.05


def test_a_report_states_the_same_share():
    (one,), _ = hold_out_tail([released()])
    value, hidden = one.averaged, one.hidden
    assert hidden is not None
    run = Run(one.name, one.time, value, value - COUNT, None, value, value, None, one.used, hidden)
    found = error_of([run], "before", hidden=True)
    assert found is not None
    assert found.ratio == pytest.approx(normalised_error([np.full(one.blocks, COUNT)], [one], hidden=True))


def test_a_part_with_more_motion_than_the_rest_is_judged_by_its_own():
    value = np.concatenate([np.zeros(800), np.tile([1.0, -1.0], 100)])
    last = np.arange(1000) >= 800
    assert motion_power(value, last) == pytest.approx(200.0)
    assert motion_power(value, np.ones(1000, bool)) == pytest.approx(200.0)
    assert motion_power(value, ~last) == pytest.approx(160.0)


def test_a_whole_record_is_judged_by_its_standard_deviation():
    one = replace(released(), hidden=None)
    assert one.power(one.used) == pytest.approx(one.blocks * np.var(one.averaged))
