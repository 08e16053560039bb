"""An effort that is held from stamp to stamp, where the stamps jitter."""

from dataclasses import replace

import numpy as np
import pytest
from axes import RATE, axis, axis_model

from rhythmid.identify.inverse_dynamics.balance import Balance
from rhythmid.identify.inverse_dynamics.estimate import fit_effort, variation_of
from rhythmid.record.record import Record


def stamped(first: float) -> Record:
    """An axis whose stamps jitter by a tenth of a period, the first of them by a given share of one."""
    plain = axis(friction=0.0, noise=0.01, jitter=0.0)
    jitter = 0.1 * np.random.default_rng(5).uniform(-1.0, 1.0, len(plain.output.time))
    jitter[0] = first
    stamps = plain.output.time + jitter / RATE
    output, effort = (replace(one, time=stamps) for one in (plain.output, plain.input))
    return replace(plain, output=output, input=effort, hold="zero")


@pytest.mark.parametrize("first", [-0.1, 0.0, 0.1], ids=["early", "exact", "late"])
def test_the_first_stamp_does_not_shift_an_effort_that_is_held(first: float):
    balance = Balance.of([stamped(first)], axis_model())
    fit = fit_effort(balance, axis_model())
    assert fit.alignment / balance.period == pytest.approx(
        -0.5, abs=0.1
    )  # it is half a period older than it is recorded
    assert fit.error < 0.02 * variation_of(balance)
