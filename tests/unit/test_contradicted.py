"""Nominal values that the records contradict are told, and such that they do not are not."""

import math

import pytest

from rhythmid.diagnose.answer.wording import recalibrated
from rhythmid.identify.identify import paper_hopper

NAME = "linear_spring.stiffness"
NOMINAL = paper_hopper()
GIVEN = NOMINAL.value(NAME)


@pytest.mark.parametrize(
    ("change", "std", "told"),
    [
        (0.05, 0.01, True),
        (0.05, 0.02, False),  # by 2.5 standard deviations
        (0.015, 1e-4, False),  # by many, and by less than matters
        (-0.05, 0.01, True),
        (0.5, math.inf, False),
    ],
)
def test_a_value_is_contradicted_by_four_standard_deviations_that_are_more_than_two_percent(
    change, std, told
):
    fitted = NOMINAL.with_values({NAME: (1.0 + change) * GIVEN})
    found = recalibrated(NOMINAL, fitted, {NAME: std * GIVEN})
    assert len(found) == told
    assert all(line.startswith(f"{NAME}: {GIVEN:.6g} in the nominal model, ") for line in found)


def test_what_was_not_estimated_is_not_told():
    fitted = NOMINAL.with_values({NAME: 2.0 * GIVEN})
    assert recalibrated(NOMINAL, fitted, {}) == ()
