"""Excitations against closed forms, and their refusals."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as some

from rhythmid.errors import InputError
from rhythmid.excitation.sequence import build

PAPER = {"type": "chirp", "amplitude": 0.004, "band": [0, 7], "sweep": 30.0}


def grid(excitation, rate=1000):
    return np.arange(round(excitation.duration * rate)) / rate


def test_a_chirp_is_equation_14_of_the_paper():
    chirp = build(PAPER)
    t = grid(chirp)
    np.testing.assert_allclose(chirp(t), 0.004 * np.sin(7 * np.pi * t**2 / 30), rtol=0, atol=1e-15)
    assert (chirp.duration, chirp.peak) == (30.0, 0.004)


def test_a_chirp_sweeps_between_any_two_frequencies():
    t = np.arange(1, 20_000) / 1000
    for low, high in [(1.0, 5.0), (5.0, 1.0)]:
        value = build({**PAPER, "band": [low, high], "sweep": 20.0, "phase": 0.4})(t)
        angle = 2 * np.pi * (low * t + (high - low) * t**2 / 40) + 0.4
        np.testing.assert_allclose(value, 0.004 * np.sin(angle), atol=1e-15)


def test_shifted_chirps_start_at_phases_spread_evenly_over_the_period():
    shifted = build(
        {**PAPER, "repetitions": 9, "warm_up": 1, "shift": {"period": 1.0, "count": 9}, "start_delay": 2.0}
    )
    assert shifted.duration == pytest.approx(2.0 + 10 * (30 + 1 / 9))
    single = build(PAPER)
    for number in range(10):
        start = 2.0 + number * (30 + 1 / 9)
        local = np.arange(0.0005, 30, 0.01)
        np.testing.assert_allclose(shifted(start + local), single(local), atol=1e-12)
        np.testing.assert_array_equal(shifted(start + np.linspace(30.0001, 30.1109, 7)), 0.0)
    np.testing.assert_array_equal(shifted(np.linspace(0, 1.999, 50)), 0.0)


def test_a_gap_is_silent():
    gapped = build({**PAPER, "repetitions": 2, "gap": 3.0})
    assert gapped.duration == 66.0
    np.testing.assert_array_equal(gapped(np.linspace(30.001, 32.999, 100)), 0.0)
    np.testing.assert_allclose(gapped(np.array([35.0])), build(PAPER)(np.array([2.0])))


def test_rounding_does_not_move_a_start_by_a_sample():
    """Sample 30111.11… of a comb of chirps: the grid time nearest to a start belongs to the chirp that starts there."""
    comb = build({**PAPER, "sweep": 0.9, "repetitions": 50, "gap": 0.1})
    starts = np.arange(50) * 1000 * 1e-3
    np.testing.assert_allclose(comb(starts), 0.0, atol=1e-9)


def test_a_multisine_has_its_lines_and_no_others():
    sine = build(
        {"type": "multisine", "rms": 0.05, "period": 10.0, "periods": 2, "band": [0.5, 3.0], "seed": 4}
    )
    t = grid(sine)
    value = sine(t)
    spectrum = np.abs(np.fft.rfft(value)) / (len(t) / 2)
    excited = np.flatnonzero(spectrum > 1e-12)
    np.testing.assert_array_equal(excited, 2 * np.arange(5, 31, 2))  # odd lines, two periods
    np.testing.assert_allclose(spectrum[excited], 0.05 * np.sqrt(2 / 13), rtol=1e-9)
    assert np.sqrt(np.mean(value**2)) == pytest.approx(0.05)
    np.testing.assert_allclose(value[:10_000], value[10_000:], atol=1e-12)


def test_a_multisine_may_be_given_line_by_line():
    spec = {"type": "multisine", "rms": 1.0, "period": 2.0, "periods": 1, "lines": [1, 3], "weights": [3, 4]}
    sine = build({**spec, "phases": [0.0, 0.5]})
    t = grid(sine)
    expected = np.sqrt(2) * (0.6 * np.cos(np.pi * t) + 0.8 * np.cos(3 * np.pi * t + 0.5))
    np.testing.assert_allclose(sine(t), expected, atol=1e-12)


def test_a_residue_class_leaves_the_other_classes_empty():
    spec = {
        "type": "multisine",
        "rms": 1.0,
        "period": 8.0,
        "band": [0, 4],
        "select": "residue",
        "pumping": 1.0,
    }
    assert build({**spec, "residue": 3}).harmonics.tolist() == [3, 11, 19, 27]
    with pytest.raises(InputError, match="whole pumping periods"):
        build({**spec, "pumping": 0.3})


def test_a_profile_steps_or_ramps_through_its_points():
    points = [[0.5, 1.0], [1.0, -2.0]]
    at = np.array([0.0, 0.499, 0.5, 0.75, 1.0, 1.9, 2.0])
    steps = build({"type": "profile", "points": points, "length": 2.0})
    np.testing.assert_allclose(steps(at), [0, 0, 1, 1, -2, -2, 0])
    ramps = build({"type": "profile", "points": points, "length": 2.0, "join": "ramp"})
    np.testing.assert_allclose(ramps(at), [0, 0, 1, -0.5, -2, -2, 0])


def test_samples_come_from_a_file_beside_the_experiment(tmp_path):
    (tmp_path / "u.csv").write_text(
        "time,force  # of a designer\n0.0,1.0\n0.1,2.0\n0.2,3.0\n", encoding="utf-8"
    )
    samples = build({"type": "samples", "file": "u.csv", "scale": 0.5}, tmp_path)
    assert samples.duration == pytest.approx(0.3)
    np.testing.assert_allclose(samples(np.array([0, 0.05, 0.1, 0.25, 0.31])), [0.5, 0.5, 1.0, 1.5, 0.0])


def test_a_sequence_plays_its_parts_in_turn_and_repeats():
    pulse = {"type": "profile", "points": [[0, 3.0]], "length": 0.5}
    sequence = build(
        {"type": "sequence", "parts": [pulse, {"type": "silence", "length": 0.5}, PAPER], "repetitions": 2}
    )
    assert (sequence.duration, sequence.peak) == (62.0, 3.0)
    at = np.array([0.0, 0.49, 0.5, 0.99, 6.0, 31.0, 31.49, 31.5, 37.0])
    chirp = build(PAPER)(np.array([5.0]))[0]
    np.testing.assert_allclose(sequence(at), [3, 3, 0, 0, chirp, 3, 3, 0, chirp], atol=1e-12)


SPECS = some.sampled_from(
    [
        {**PAPER, "sweep": 1.0, "repetitions": 3, "shift": {"period": 0.5, "count": 3}},
        {"type": "multisine", "rms": 0.1, "period": 2.0},
        {"type": "profile", "points": [[0.1, 1.0], [0.7, -1.0]], "length": 1.0, "join": "ramp"},
        {"type": "silence", "length": 1.0},
        {
            "type": "sequence",
            "parts": [{**PAPER, "sweep": 0.5}, {"type": "silence", "length": 0.3}],
            "repetitions": 3,
        },
    ]
)


@given(SPECS, some.lists(some.floats(-10, 100), min_size=1, max_size=40))
def test_an_excitation_is_a_pure_function_of_time_zero_outside_and_within_its_peak(spec, times):
    excitation = build(spec)
    t = np.array(times)
    value = excitation(t)
    np.testing.assert_array_equal(value, np.concatenate([excitation(t[i : i + 1]) for i in range(len(t))]))
    assert not np.any(value[(t < 0) | (t >= excitation.duration)])
    assert np.all(np.abs(value) <= excitation.peak * (1 + 1e-3))


@pytest.mark.parametrize(
    ("spec", "words"),
    [
        ({}, "excitation: 'type:' is missing"),
        (
            {"type": "chrip"},
            "excitation: type: 'chrip' is none of chirp, multisine, profile, samples, silence, sequence",
        ),
        ({"type": "chirp"}, "excitation: 'amplitude:' is missing"),
        ({**PAPER, "amplitude": "big"}, "amplitude: a number is expected, not 'big'"),
        ({**PAPER, "amplitude": float("nan")}, "amplitude: is not a number (NaN)"),
        ({**PAPER, "sweep": -1}, "sweep: -1 is too small; more than 0 is expected"),
        ({**PAPER, "sweeep": 1}, "sweeep: unknown key; did you mean 'sweep'?"),
        ({**PAPER, "band": [3, 3]}, "band: two different frequencies are needed"),
        ({**PAPER, "band": [3]}, "band: item 2 is missing"),
        ({"type": "multisine", "rms": 1, "band": [0.01, 0.02]}, "no line of the multisine falls into it"),
        ({"type": "multisine", "rms": 1, "lines": [1, 2], "phases": [0]}, "phases: 1 values for 2 lines"),
        ({"type": "profile", "points": [[1, 0], [1, 2]], "length": 2}, "points: the times must increase"),
        ({"type": "profile", "points": [], "length": 2}, "points: tuple should have at least 1 item"),
        ({"type": "sequence", "parts": [{"type": "silence"}]}, "excitation: parts[0]: 'length:' is missing"),
        ({"type": "samples", "file": "missing.csv"}, "missing.csv: cannot be read: No such file"),
    ],
)
def test_a_wrong_excitation_is_refused_in_one_line(spec, words):
    with pytest.raises(InputError) as refused:
        build(spec)
    assert words in str(refused.value) and "\n" not in str(refused.value)


@pytest.mark.parametrize(
    ("content", "words"),
    [
        ("0,1\n0.1\n", ":2: two finite numbers are expected"),
        ("0,1\n0.1,nan\n", ":2: two finite numbers are expected"),
        ("0,1\n0.1,x\n", ":2: two finite numbers are expected"),
        ("0,1\n0.1,2,3\n", ":2: two finite numbers are expected"),
        ("t,u\nmore,words\n", ":2: two finite numbers are expected"),
        ("0,1\n0,2\n", ":2: the times must increase"),
        ("t,u\n", ": holds no numbers"),
        ("", ": holds no numbers"),
    ],
)
def test_a_wrong_table_is_refused_with_its_line(content, words, tmp_path):
    (tmp_path / "u.csv").write_text(content, encoding="utf-8")
    with pytest.raises(InputError) as refused:
        build({"type": "samples", "file": "u.csv"}, tmp_path)
    assert f"u.csv{words}" in str(refused.value)


@given(some.integers(0, 1000), some.floats(0.5, 40.0), some.floats(0.0, 1.0))
def test_the_peak_of_a_multisine_is_the_largest_of_its_values(seed, period, late):
    multisine = build({
        "type": "multisine", "rms": 0.3, "period": period, "band": [2.0, 9.0], "select": "all", "seed": seed, "start_delay": late,
    })  # fmt: skip
    dense = np.abs(multisine(late + np.linspace(0.0, period, 20_000, endpoint=False))).max()
    assert multisine.peak == pytest.approx(dense, rel=2e-3)
