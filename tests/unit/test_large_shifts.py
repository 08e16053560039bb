"""Cautions about delays: one for each that no machine has, whether the records give it a standard deviation or not."""

import numpy as np
import pytest

from rhythmid.identify.identification import Delays, Estimate
from rhythmid.identify.identify import paper_hopper
from rhythmid.identify.large_shifts import large_shifts
from rhythmid.record.record import Channel, Record

STIFFNESS = "linear_spring.stiffness"
TIME = np.arange(0.0, 7.0, 0.01)
RECORD = Record("run", Channel(TIME, np.sin(TIME), "m"))
NONE = Estimate(None, None, "s")


def cautions(total: Estimate) -> list[tuple[str, str]]:
    delays = Delays(NONE, NONE, total, False, "only the sum is identifiable")
    return [(one.name, one.text) for one in large_shifts(paper_hopper(), {}, delays, [RECORD])]


@pytest.mark.parametrize("std", [None, 0.002])
def test_a_negative_delay_is_told_with_and_without_a_standard_deviation(std):
    ((name, text),) = cautions(Estimate(-0.1062, std, "s"))
    assert name == "negative_delay" and "106" in text
    assert ("which the records do not determine" in text) is (std is None)


@pytest.mark.parametrize("std", [None, 0.002])
def test_a_delay_that_is_longer_than_the_record_is_told_so(std):
    ((name, text),) = cautions(Estimate(24.77, std, "s"))
    assert name == "long_delay" and "longer than the record of 6.99 s" in text


def test_a_long_delay_without_a_standard_deviation_is_told_by_its_samples():
    ((name, text),) = cautions(Estimate(0.25, None, "s"))
    assert name == "long_delay" and "25 samples more than the nominal 0 ms" in text


def test_a_delay_of_some_samples_is_not_told():
    assert cautions(Estimate(0.05, None, "s")) == cautions(Estimate(0.05, 0.001, "s")) == []


def test_a_delay_longer_than_the_record_is_told_even_where_cycle_and_response_agree():
    both = Estimate(9.0, 0.001, "s"), Estimate(0.05, 0.001, "s")
    delays = Delays(*both, Estimate(9.05, 0.001, "s"), True, "the forcing is known", closure=0.3)
    (one,) = large_shifts(paper_hopper(), {}, delays, [RECORD])
    assert one.name == "long_delay" and one.parameter == "delay: input"


@pytest.mark.parametrize(
    ("ratio", "told"),
    [
        (1e9, "more than a million times"),
        (1e-12, "less than a millionth of"),
        (20.0, "20 times"),
        (0.1, "a 10th of"),
    ],
)
def test_how_far_a_value_is_from_the_nominal_one_is_told_up_to_a_million(ratio, told):
    model = paper_hopper()
    value = ratio * model.value(STIFFNESS)
    delays = Delays(NONE, NONE, NONE, False, "only the sum is identifiable")
    (one,) = large_shifts(model, {STIFFNESS: Estimate(value, 1e-3 * value, "N/m")}, delays, [RECORD])
    assert f"{told} the nominal" in one.text
