"""Measurements outside the samples of a force that acts all the time: the force is continued, or they are left out."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rhythmid.record.gaps import cut_at_gaps
from rhythmid.record.record import Channel, Record

RATE = 250.0
TIME = np.arange(3000) / RATE
PUMP = 6.0 * np.cos(2.0 * np.pi * 1.4 * TIME)
BROAD = np.cumsum(np.random.default_rng(1).standard_normal(len(TIME)))


def record(**fields):
    noise = 1e-4 * np.random.default_rng(0).standard_normal(len(TIME))
    return Record("log", Channel(TIME, np.sin(4.4 * TIME) + noise, "m"), **fields)


def within(value, first, last):
    heard = (first <= TIME) & (last >= TIME)
    return Channel(TIME[heard], value[heard], "N")


@given(first=st.floats(0.05, 2.0), last=st.floats(10.0, 11.9))
@settings(max_examples=20)
def test_a_periodic_forcing_is_continued_to_the_ends_of_the_output(first, last):
    found = cut_at_gaps(record(input=None, forcing=within(PUMP, first, last)))
    (one,) = found.stretches
    assert len(one.output) == len(TIME) and not found.notes
    assert (
        one.forcing is not None
        and one.forcing.time[0] < 2.0 / RATE < TIME[-1] - 2.0 / RATE < one.forcing.time[-1]
    )
    np.testing.assert_allclose(
        one.forcing.value, 6.0 * np.cos(2.0 * np.pi * 1.4 * one.forcing.time), atol=1e-6
    )


@pytest.mark.parametrize(
    "fields",
    [{"forcing": 0.0, "input": None}, {"input": 0.0, "hold": "linear"}, {"input": 0.0, "input_kind": "base_displacement"}],
    ids=["forcing", "measured force", "shaken base"],
)  # fmt: skip
def test_the_output_is_left_out_where_a_force_that_does_not_repeat_is_not_recorded(fields):
    made = record(
        **{key: within(BROAD, 0.4, 11.0) if value == 0.0 else value for key, value in fields.items()}
    )
    found = cut_at_gaps(made)
    (one,) = found.stretches
    assert one.output.time[0] >= 0.4 and one.output.time[-1] <= 11.0 and one.name == "log"
    assert any("0.4 to 11 s only" in note for note in found.notes)


@pytest.mark.parametrize("fields", [{"hold": "zero"}, {"hold": "linear", "input_kind": "reference"}], ids=str)
def test_what_a_program_sends_begins_with_its_first_sample(fields):
    found = cut_at_gaps(record(input=within(BROAD, 0.4, 11.0), **fields))
    (one,) = found.stretches
    assert len(one.output) == len(TIME) and not found.notes


def test_a_constant_force_keeps_its_value():
    given_ = record(input=None, forcing=within(0.0 * TIME + 3.0, 1.0, 11.0))
    found = cut_at_gaps(given_)
    assert found.stretches == (given_,) and not found.notes


def test_nothing_is_left_out_where_hardly_any_measurement_would_remain():
    made = record(input=within(BROAD, 5.0, 5.06), hold="linear")
    assert cut_at_gaps(made).stretches == (made,)


def test_a_forcing_is_not_continued_for_longer_than_it_was_recorded():
    made = record(input=None, forcing=within(PUMP, 9.0, 12.0))
    (one,) = cut_at_gaps(made).stretches
    assert one.output.time[0] >= 9.0 and one.forcing is not None and len(one.forcing) < 800


def test_ends_within_a_sample_are_no_gap():
    made = record(input=replace(within(BROAD, 0.0, 12.0), time=TIME + 0.5 / RATE), hold="linear")
    assert cut_at_gaps(made).stretches == (made,)
