"""Jitter of stamps is read off the samples alone, and what has none is left as it is."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rhythmid.identify.noise import NoiseModel
from rhythmid.identify.series import prepare
from rhythmid.record.read import read_record
from rhythmid.record.record import Channel, Record
from rhythmid.record.stamp_jitter import stamp_jitter

RATE = 500.0
TIME = np.arange(10_000) / RATE
NOISE = 1e-3


def motion(time: np.ndarray, seed: int = 0) -> np.ndarray:
    """A sum of cosines of 0.2 to 3 Hz."""
    rng = np.random.default_rng(seed)
    lines = np.linspace(0.2, 3.0, 8)
    phases = rng.uniform(0.0, 2.0 * np.pi, len(lines))
    return sum(a * np.cos(2 * np.pi * f * time + p) for a, f, p in zip(rng.normal(size=8), lines, phases))  # pyright: ignore[reportReturnType]


def sampled(jitter: float, seed: int = 0) -> np.ndarray:
    rng = np.random.default_rng(seed)
    late = jitter * rng.uniform(-np.sqrt(3.0), np.sqrt(3.0), len(TIME))
    return motion(TIME + late, seed) + rng.normal(0.0, NOISE, len(TIME))


def record(value: np.ndarray) -> Record:
    return Record("made", Channel(TIME, value, "m"))


@pytest.mark.parametrize("jitter", [2e-4, 1e-3])
def test_jitter_and_noise_are_found_within_their_uncertainty(jitter):
    for seed in range(5):
        found = stamp_jitter([(TIME, sampled(jitter, seed))])
        assert found is not None
        assert found.std == pytest.approx(jitter, abs=4.0 * found.uncertainty, rel=0.05)
        assert found.uncertainty < 0.1 * jitter


def test_stretches_of_a_channel_tell_together_what_each_is_too_short_for():
    value = sampled(5e-4)
    parts = [(TIME[k : k + 1000], value[k : k + 1000]) for k in range(0, 10_000, 1000)]
    assert stamp_jitter(parts[:1]) is None
    assert stamp_jitter(parts) is not None


@settings(max_examples=30, deadline=None)
@given(
    seed=st.integers(0, 10_000),
    noise=st.sampled_from([0.0, 1e-7, 1e-4, 1e-2]),
    step=st.sampled_from([0.0, 0.5, 3.0]),
    told=st.booleans(),
    colour=st.sampled_from([0.0, 0.8]),
)
def test_noise_of_any_colour_rounding_and_irregular_stamps_that_are_true_are_no_jitter(
    seed, noise, step, told, colour
):
    rng = np.random.default_rng(seed)
    time = TIME + (0.1 / RATE * rng.standard_normal(len(TIME)).clip(-4.0, 4.0) if told else 0.0)
    coloured = NoiseModel(np.array([colour]), 1.0).colour(rng.standard_normal(len(TIME)))
    value = motion(time, seed) + noise * coloured
    if step:
        grid = step * max(noise, 1e-5)
        value = grid * np.round(value / grid)
    assert stamp_jitter([(time, value)]) is None


def test_a_bang_at_the_highest_speed_is_no_jitter():
    period = 0.4
    phase = TIME % period
    bouncing = 4.9 * phase * (period - phase)  # a ball that meets the floor at its highest speed
    value = bouncing + np.random.default_rng(0).normal(0.0, 1e-5, len(TIME))
    assert stamp_jitter([(TIME, value)]) is None


def test_fast_samples_of_a_record_with_jitter_weigh_less_and_the_noise_keeps_its_mean_square():
    (one,) = prepare([record(sampled(2e-3))])
    assert one.spread is not None
    slope = np.abs(np.gradient(one.averaged))
    fast, slow = slope > np.quantile(slope, 0.9), slope < np.quantile(slope, 0.1)
    assert one.spread[fast].min() > 2.0 * one.spread[slow].mean()
    assert np.mean(one.spread**2) == pytest.approx(1.0)


def test_a_record_without_jitter_is_weighed_as_it_is():
    (one,) = prepare([record(sampled(0.0))])
    assert one.spread is None
    samples = np.arange(float(one.blocks))
    assert one.levelled(samples) is samples


def test_samples_at_a_declared_rate_have_no_stamps_that_could_jitter(tmp_path):
    np.savetxt(
        tmp_path / "log.csv", np.column_stack([TIME, sampled(1e-3)]), delimiter=",", header="t,y", comments=""
    )
    jitter = {}
    for clock in ("sample_rate: 500", "column: t"):
        (tmp_path / "signals.yaml").write_text(
            f"time: {{{clock}}}\ninput: none\noutput: {{column: y, unit: m}}\n"
        )
        one = read_record(tmp_path / "log.csv", tmp_path / "signals.yaml")
        jitter[clock] = (
            one.quality.channels["output"].stamp_jitter,
            any("jitter" in note for note in one.quality.notes),
            prepare([one])[0].spread is not None,
        )
    assert jitter["sample_rate: 500"] == (None, False, False)
    assert jitter["column: t"][0] == pytest.approx(1e-3, rel=0.1) and jitter["column: t"][1:] == (True, True)
