"""One grid for all channels: what lies on it is copied, what does not is interpolated truly, what is missing is said."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from rhythmid.errors import InputError
from rhythmid.record.record import Channel, Record
from rhythmid.record.signals import Sinusoid

RATE = 1000.0
N = 1500
GRID = np.arange(N) / RATE
seeds = st.integers(0, 10_000)


def band_limited(time, seed, highest=20.0, lines=8):
    """A sum of cosines [arbitrary unit] of at most `highest` Hz and rms of about 1."""
    rng = np.random.default_rng(seed)
    frequency, phase = rng.uniform(0.2, highest, lines), rng.uniform(0, 2 * np.pi, lines)
    amplitude = rng.standard_normal(lines) * np.sqrt(2.0 / lines)
    return np.cos(2 * np.pi * np.multiply.outer(time, frequency) + phase) @ amplitude


def jittered(seed, jitter, n=N):
    """Stamps with an error that is uniform within ± `jitter` periods, in order."""
    return np.sort(np.arange(n) + np.random.default_rng(seed).uniform(-jitter, jitter, n)) / RATE


def record(**channels) -> Record:
    made = {
        role: Channel(np.asarray(time, dtype=float), np.asarray(value, dtype=float), "1")
        for role, (time, value) in channels.items()
    }
    return Record("made", **made)


@given(seed=seeds, jitter=st.floats(0.0, 0.45))
def test_a_band_limited_signal_sampled_at_jittered_stamps_is_restored(seed, jitter):
    time = jittered(seed, jitter)
    uniform = record(output=(time, band_limited(time, seed))).uniform(RATE)
    inside = slice(10, -10)  # a spline knows less at its ends
    truth = band_limited(uniform.time, seed)
    assert np.abs(uniform.output - truth)[inside].max() < 3e-4


@given(seed=seeds, rate=st.floats(200.0, 5000.0))
def test_it_is_restored_at_any_rate(seed, rate):
    uniform = record(output=(GRID, band_limited(GRID, seed))).uniform(rate)
    inside = (uniform.time > 0.01) & (uniform.time < GRID[-1] - 0.01)
    assert np.abs(uniform.output - band_limited(uniform.time, seed))[inside].max() < 3e-4
    np.testing.assert_allclose(np.diff(uniform.time), 1.0 / rate, rtol=1e-9)


@given(seed=seeds, value=st.floats(-1e6, 1e6), jitter=st.floats(0.0, 0.45), rate=st.floats(100.0, 3000.0))
def test_a_constant_stays_the_constant(seed, value, jitter, rate):
    time = jittered(seed, jitter)
    flat = np.full(N, value)
    uniform = record(output=(time, flat), input=(time, flat), velocity=(time[::3], flat[::3])).uniform(rate)
    for found in (uniform.output, uniform.input, uniform.velocity):
        np.testing.assert_allclose(found, value, rtol=1e-12)


@given(seed=seeds, shift=st.integers(0, 2_000_000))
def test_samples_on_the_grid_are_copied_and_shifting_all_stamps_changes_nothing(seed, shift):
    value = np.random.default_rng(seed).standard_normal(N)
    made = record(output=(GRID, value), input=(GRID, -value))
    later = record(output=(GRID + 1e-3 * shift, value), input=(GRID + 1e-3 * shift, -value))
    for uniform in (made.uniform(), later.uniform()):
        np.testing.assert_array_equal(uniform.output, value)
        np.testing.assert_array_equal(uniform.input, -value)
        assert uniform.valid.all() and uniform.rate == pytest.approx(RATE, rel=1e-12)


@given(seed=seeds, offset=st.floats(0.0, 0.999))
def test_a_held_input_keeps_its_value_until_the_next_one(seed, offset):
    rng = np.random.default_rng(seed)
    sent = np.sort(rng.choice(10 * N, 200, replace=False)) / (10 * RATE)
    assume(sent[0] < 0.5)
    value = rng.standard_normal(200)
    time = GRID + offset / RATE
    uniform = record(output=(time, np.sin(time)), input=(sent, value)).uniform()
    for at, found in zip(uniform.time, uniform.input):
        assert found == value[np.flatnonzero(sent <= at + 1e-9)[-1]]


@given(seed=seeds)
def test_channels_of_unequal_rates_meet_on_the_grid_of_the_output(seed):
    slow = np.arange(N // 4) * 4 / RATE
    fast = np.arange(4 * N) / (4 * RATE)
    uniform = record(
        output=(GRID, band_limited(GRID, seed)), velocity=(slow, band_limited(slow, seed)),
        effort=(fast, band_limited(fast, seed)),
    ).uniform()  # fmt: skip
    truth = band_limited(uniform.time, seed)
    assert uniform.rate == pytest.approx(RATE)
    np.testing.assert_array_equal(uniform.output, band_limited(GRID, seed)[: len(truth)])
    assert np.abs(uniform.effort - truth).max() < 1e-12  # every fourth sample lies on the grid
    assert np.abs(uniform.velocity - truth)[20:-20].max() < 0.03


@given(seed=seeds, share=st.floats(0.0, 0.09))
def test_a_value_that_bridges_several_lost_samples_is_marked(seed, share):
    rng = np.random.default_rng(seed)
    kept = rng.random(N) >= share
    kept[[0, -1]] = True
    value = band_limited(GRID, seed)
    uniform = record(output=(GRID[kept], value[kept])).uniform(RATE)
    alone = ~kept & np.roll(kept, 1) & np.roll(kept, -1)
    assert uniform.valid[kept | alone].all()
    many = np.convolve(~kept, np.ones(5), mode="same") == 5  # in the middle of at least five
    assert not uniform.valid[many].any()
    np.testing.assert_array_equal(uniform.output[kept], value[kept])


def test_a_command_that_is_sent_when_it_changes_has_no_gaps():
    sent = np.array([0.0, 0.01, 0.4, 0.41, 1.1])
    uniform = record(output=(GRID, np.sin(GRID)), input=(sent, np.arange(5.0))).uniform()
    assert uniform.valid.all() and uniform.input[1050] == 3.0


def test_a_single_command_stays_in_force():
    uniform = record(output=(GRID, np.sin(GRID)), input=([0.0], [3.0])).uniform()
    assert len(uniform) == N and (uniform.input == 3.0).all()


def test_a_forcing_known_by_formula_is_evaluated_not_interpolated():
    law = Sinusoid(2.0, 1.3, 0.4)
    made = replace(record(output=(GRID, np.sin(GRID))), forcing_law=law)
    np.testing.assert_allclose(made.uniform().forcing, law(GRID), atol=1e-12)


def test_a_band_limited_input_is_restored_between_its_samples():
    time = np.arange(400) / 100.0
    made = replace(
        record(output=(GRID, np.sin(GRID)), input=(time, band_limited(time, 3))), hold="band_limited"
    )
    uniform = made.uniform()
    inside = slice(100, -100)
    assert np.abs(uniform.input - band_limited(uniform.time, 3))[inside].max() < 5e-3


def test_a_band_limited_input_must_be_evenly_spaced():
    made = replace(record(output=(GRID, np.sin(GRID)), input=(jittered(1, 0.3), GRID)), hold="band_limited")
    with pytest.raises(InputError, match="input is not evenly spaced"):
        made.uniform()


def test_channels_without_common_time_are_refused():
    with pytest.raises(InputError, match="less than 8 samples in common"):
        record(output=(GRID, GRID), velocity=(GRID + 1.4955, GRID)).uniform()


@pytest.mark.parametrize("rate", [0.0, -10.0, np.nan, np.inf])
def test_an_impossible_rate_is_refused(rate):
    with pytest.raises(InputError, match="is impossible"):
        record(output=(GRID, GRID)).uniform(rate)


@given(seed=seeds, start=st.floats(0.0, 1.0), length=st.floats(0.05, 0.4))
def test_a_cut_keeps_what_lies_within_and_the_command_in_force(seed, start, length):
    rng = np.random.default_rng(seed)
    sent = np.concatenate([[0.0], np.sort(rng.uniform(0, 1.5, 20))])
    made = record(output=(GRID, np.sin(GRID)), input=(sent, rng.standard_normal(21))).cut(
        start, start + length
    )
    assert made.output.time[0] >= start - 1e-9 and made.output.time[-1] < start + length
    assert len(made.output) == np.count_nonzero((GRID >= start - 1e-9) & (GRID < start + length - 1e-9))
    assert made.input.time[0] <= made.output.time[0] + 1e-9
    assert not np.any((made.input.time[1:] < start - 1e-9) | (made.input.time[1:] >= start + length))
