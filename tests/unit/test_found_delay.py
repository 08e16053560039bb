"""A delay of the motion behind the effort is told and saved, unless the stamps explain it or the fit stops at its limit."""

from dataclasses import replace

import numpy as np
import pytest
from axes import axis, axis_model

from rhythmid.diagnose.answer.wording import unstated_delay
from rhythmid.diagnose.effort.candidate import late_start
from rhythmid.diagnose.effort.fitted import Fitted
from rhythmid.diagnose.effort.found_delay import delay_told, found_delay, with_found_delay
from rhythmid.identify.inverse_dynamics.balance import Balance
from rhythmid.identify.inverse_dynamics.estimate import Alignment, fit_effort
from rhythmid.model import Model
from rhythmid.record.record import Channel, Record

NOMINAL = axis_model()
PERIOD = 1.0 / 250.0


def delayed(late: float) -> Record:
    """An axis whose effort is stamped `late` [s] before it acts."""
    record = axis(friction=0.0, noise=0.01, jitter=0.0)
    assert record.input is not None
    moved = np.interp(record.input.time + late, record.input.time, record.input.value)
    return replace(record, input=replace(record.input, value=moved))


def fitted(balance: Balance, model: Model = NOMINAL, aligned: Alignment | None = None) -> Fitted:
    return Fitted.of((), "nominal", fit_effort(balance, model, aligned=aligned), {}, balance)


def test_a_delay_of_more_than_a_sample_is_told_and_saved():
    balance = Balance.of([delayed(1.6 * PERIOD)], NOMINAL)
    one = fitted(balance)
    (said,) = delay_told(balance, one, NOMINAL)
    assert said.startswith("input_delay.delay: none in the nominal model, 6.") and said.endswith(
        " ms in the records"
    )
    saved = with_found_delay(balance, one, NOMINAL)
    assert Model.from_text(saved.to_yaml()).value("input_delay.delay") == pytest.approx(
        1.6 * PERIOD, rel=0.05
    )


def test_what_the_stamps_explain_is_not_told():
    balance = Balance.of([delayed(0.4 * PERIOD)], NOMINAL)
    one = fitted(balance)
    assert delay_told(balance, one, NOMINAL) == ()
    assert with_found_delay(balance, one, NOMINAL) == one.model


def test_a_delay_at_the_limit_of_the_fit_has_no_standard_deviation():
    balance = Balance.of([delayed(4.0 * PERIOD)], NOMINAL)
    one = fitted(balance)
    assert one.fit.at_limit[0]
    assert found_delay(balance, one).std is None
    assert delay_told(balance, one, NOMINAL) == ()


def test_an_effort_that_is_stamped_after_the_motion_has_no_delay():
    balance = Balance.of([delayed(-4.0 * PERIOD)], NOMINAL)
    usual = fit_effort(balance, NOMINAL)
    assert usual.at_limit[0] and usual.alignment < 0.0
    aligned, start = late_start(balance, usual)
    longer = fit_effort(balance, NOMINAL, aligned=aligned, alignment=start)
    assert longer.alignment == 0.0 and longer.cost > usual.cost


def test_an_effort_of_a_slower_sensor_is_aligned_in_its_own_samples():
    record = axis(friction=0.0, noise=0.01, jitter=0.0)
    assert record.input is not None
    force = record.input
    slow = Channel(force.time[::5], force.value[::5], "N")
    balance = Balance.of([replace(record, input=None, effort=slow)], NOMINAL)
    assert balance.period == pytest.approx(5.0 * PERIOD)
    found = found_delay(balance, fitted(balance))
    assert found.std is not None and abs(found.value) < 3.0 * found.std


def test_a_delay_that_noise_may_explain_is_not_told():
    assert unstated_delay(0.003, 0.001) == unstated_delay(-0.003, 1e-4) == unstated_delay(0.003, None) == ()
    assert unstated_delay(0.00252, 0.00016) == (
        "input_delay.delay: none in the nominal model, 2.52 ± 0.16 ms in the records",
    )
