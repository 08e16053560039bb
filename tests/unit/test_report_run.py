"""What a residual shows: sizes, cycle, spectrum, place."""

from dataclasses import replace

import numpy as np
import pytest

from rhythmid.report.run import Run, by_phase, density, error_of, harmonics, worst_place

STEP = 0.005


def run(residual: np.ndarray, **changes) -> Run:
    """A record of a 1 Hz motion of 10 mm from which a model departs by `residual`."""
    time = np.arange(len(residual)) * STEP
    motion = 0.01 * np.cos(2 * np.pi * time)
    velocity = -0.01 * 2 * np.pi * np.sin(2 * np.pi * time)
    everything = np.ones(len(time), bool)
    made = Run(
        "test", time, motion, motion - residual, motion, motion, velocity, time % 1.0, everything, ~everything
    )
    return replace(made, **changes)


TIME = np.arange(6000) * STEP


def test_the_error_is_the_rms_over_the_motions_standard_deviation() -> None:
    found = error_of([run(0.001 * np.sin(2 * np.pi * 3 * TIME))], "before")
    assert found is not None
    assert found.rms == pytest.approx(0.001 / np.sqrt(2), rel=1e-3)
    assert found.ratio == pytest.approx(0.1, rel=1e-3)


def test_the_repaired_model_leaves_nothing() -> None:
    found = error_of([run(0.001 * np.ones(6000))], "after")
    assert found is not None
    assert found.rms == pytest.approx(0.0, abs=1e-15)


def test_the_interval_of_an_error_covers_repetitions_of_the_noise() -> None:
    rng = np.random.default_rng(3)
    hits = 0
    for _ in range(200):
        found = error_of([run(1e-3 * rng.standard_normal(2000))], "before")
        assert found is not None and found.half is not None
        hits += abs(found.ratio - 1e-3 / (0.01 / np.sqrt(2))) < found.half
    assert 0.85 <= hits / 200 <= 0.99


def test_only_samples_that_count_enter() -> None:
    residual = np.where(TIME < 15.0, 1e-3, 5e-3)
    hidden = TIME >= 15.0
    cut = run(residual, used=~hidden, hidden=hidden)
    seen, unseen = error_of([cut], "before"), error_of([cut], "before", hidden=True)
    assert seen is not None and unseen is not None
    assert (seen.rms, unseen.rms) == (pytest.approx(1e-3), pytest.approx(5e-3))
    assert error_of([run(residual)], "before", hidden=True) is None


def test_the_mean_over_the_cycle_recovers_what_repeats() -> None:
    rng = np.random.default_rng(5)
    repeated = 1e-3 * np.sin(2 * np.pi * 2 * TIME)
    found = by_phase(run(repeated + 1e-3 * rng.standard_normal(6000)), "before")
    assert found is not None
    phase, mean, std = found
    assert np.mean(np.abs(mean - 1e-3 * np.sin(2 * np.pi * 2 * phase)) < 1.96 * std) > 0.85
    assert by_phase(run(repeated, phase=None), "before") is None


def test_the_spectral_density_of_white_noise_is_flat_at_its_level() -> None:
    rng = np.random.default_rng(7)
    noise = 1e-4 * rng.standard_normal(60_000)
    _, level = density(run(noise), noise)
    assert np.sqrt(np.mean(level**2)) == pytest.approx(1e-4 * np.sqrt(2 * STEP), rel=0.03)


def test_harmonics_are_amplitudes_with_the_noise_of_the_mean() -> None:
    found = harmonics(run(2e-4 * np.cos(2 * np.pi * 3 * TIME + 0.4)), noise=1e-4)
    assert found[0].measured == pytest.approx(0.01, rel=1e-6)
    assert [h.before for h in found[:3]] == pytest.approx([0.0, 0.0, 2e-4], abs=1e-12)
    assert found[0].std == pytest.approx(1e-4 * np.sqrt(2 / 6000))


def test_the_worst_place_is_where_the_mismatch_was_put() -> None:
    burst = 2e-3 * np.sin(2 * np.pi * 4 * TIME) * (np.abs(TIME - 21.0) < 1.0)
    quiet, loud = run(1e-6 * np.sin(TIME)), run(burst, name="loud")
    place = worst_place([quiet, loud])
    assert place is not None
    assert place.run.name == "loud"
    assert place.time == pytest.approx(21.0, abs=1.1)
    assert place.frequency == pytest.approx(4.0, abs=0.2)
