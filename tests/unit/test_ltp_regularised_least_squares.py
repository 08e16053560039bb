"""Equation (5): against a dense solution, its predicted bias against the bias seen, and the choice of α."""

import numpy as np
import pytest

from rhythmid.ltp.htf import LinearisedModel, delay_phase, linearised
from rhythmid.ltp.nonparametric import smoothed
from rhythmid.ltp.pumping import Pumping, pumping_of
from rhythmid.ltp.regularised_least_squares import estimate_htf, regularised_least_squares
from rhythmid.ltp.spectra import Spectra, Window, spectra

PUMPING = Pumping.cosine(1.0, 1.0)


@pytest.fixture(scope="module")
def plant(rig) -> LinearisedModel:
    return linearised(rig.hopper, PUMPING)


@pytest.fixture(scope="module")
def measured(paper_record, plant) -> Spectra:
    made = paper_record()
    return spectra(made, pumping_of(made), plant.cycle.ring_down)


def small(rng: np.random.Generator) -> Spectra:
    bins = 120
    signal = rng.standard_normal(bins) + 1j * rng.standard_normal(bins)
    other = rng.standard_normal(bins) + 1j * rng.standard_normal(bins)
    signal[0], other[0] = signal[0].real, other[0].real
    return Spectra(PUMPING, Window(0.0, 20, 0.0), signal, other, np.zeros(3, dtype=complex))


def test_the_banded_solution_is_the_dense_one_of_equation_5() -> None:
    made = small(np.random.default_rng(2))
    operator = regularised_least_squares(made, 1, window=5.0)
    n, h = len(operator.bins), 3
    u = np.zeros((n, h * n), dtype=complex)
    for row in range(h):
        u[np.arange(n), row * n + np.arange(n)] = operator.shifted[row]
    second = np.diff(np.eye(n), 2, axis=0)
    penalty = np.kron(np.eye(h), second.T @ second)
    output = made.output_at(operator.bins)
    dense = np.linalg.solve(u.conj().T @ u + operator.alpha * penalty, u.conj().T @ output).reshape(h, n)
    assert operator.solve(output) == pytest.approx(dense, abs=1e-6 * np.abs(dense).max())


def test_a_record_too_short_for_the_window_is_smoothed_over_the_whole_band() -> None:
    made = small(np.random.default_rng(4))
    estimate = estimate_htf(regularised_least_squares(made, 1, window=1e-3))
    assert np.isfinite(estimate.htf.std).all() and estimate.htf.std.shape == estimate.htf.value.shape


def test_a_machine_faster_than_the_band_resolves_is_smoothed_over_the_shortest_time_of_the_band() -> None:
    made = small(np.random.default_rng(4))
    operator = regularised_least_squares(made, 1, ring_down=0.0)  # its rest after one period underflows
    assert operator.window == pytest.approx(0.5 / made.band[1])
    assert np.isfinite(estimate_htf(operator).htf.value).all()


def test_estimates_of_a_real_system_have_conjugate_symmetry() -> None:
    operator = regularised_least_squares(small(np.random.default_rng(3)), 2, window=5.0)
    found = operator.solve(operator.spectra.output_at(operator.bins))
    assert found[::-1, ::-1] == pytest.approx(found.conj(), abs=1e-9 * np.abs(found).max())


def test_the_papers_record_gives_the_theoretical_htfs(measured, plant) -> None:
    found = estimate_htf(regularised_least_squares(measured, 3, ring_down=plant.cycle.ring_down))
    truth = plant.htf(found.htf.harmonics, found.htf.frequency)
    turned = truth * np.exp(-1j * delay_phase(found.htf.harmonics, found.htf.frequency, 0.04, 0.05, 1.0))
    for m, worst, typical in ((0, 0.008, 0.002), (-1, 0.03, 0.008), (1, 0.05, 0.012)):
        row = found.htf.row(m)
        seen = found.reached[row] & (found.htf.frequency < 6.0)
        error = np.abs(found.htf.value[row] - turned[row])[seen] / np.abs(truth[row]).max()
        assert error.max() < worst
        assert np.sqrt(np.mean(error**2)) < typical


@pytest.mark.parametrize("share", [2.0, 3.0, 12.0])
def test_bands_of_smoothed_estimates_contain_their_bias(measured, plant, share: float) -> None:
    """A record without noise, smoothed too much: what errs is the smoothing alone."""
    estimate = estimate_htf(regularised_least_squares(measured, 3, window=share * plant.cycle.ring_down))
    for one in smoothed(estimate).functions:
        truth = plant.htf(np.array([one.m]), one.frequency)
        turned = (truth * np.exp(-1j * delay_phase(np.array([one.m]), one.frequency, 0.04, 0.05, 1.0)))[0]
        assert np.mean(np.abs(one.value - turned) < one.radius) > 0.92


@pytest.mark.parametrize("window", [4.0, 8.0, 24.0])
def test_the_loss_of_the_peak_is_what_was_predicted(measured, plant, window: float) -> None:
    operator = regularised_least_squares(measured, 3, window=window)
    found = estimate_htf(operator)
    turn = delay_phase(operator.harmonics, operator.frequency, 0.04, 0.05, 1.0)
    truth = operator.model_htf(plant.htf) * np.exp(-1j * turn)
    row, keep = found.htf.row(0), operator.positive
    peak = np.argmax(np.abs(truth[row, keep]))
    expected = np.abs(operator.smooth(truth)[row, keep][peak] / truth[row, keep][peak])
    seen = np.abs(found.htf.value[row, peak] / truth[row, keep][peak])
    assert seen == pytest.approx(expected, abs=0.004)
    # the window on the impulse response: 1 − ∫ exp(−t/τ) / (1 + (t/t_c)⁴) dt / τ
    tau = plant.cycle.ring_down
    t = np.linspace(0.0, 12 * tau, 4001)
    share = np.sum(np.exp(-t / tau) / (1 + (t / window) ** 4)) * t[1] / tau
    assert expected == pytest.approx(share, abs=0.015)


def test_alpha_states_a_time_that_is_the_same_for_records_of_any_length_and_size(measured) -> None:
    operator = regularised_least_squares(measured, 3, ring_down=1.95)
    assert operator.window == pytest.approx(12 * 1.95)
    again = regularised_least_squares(measured, 3, alpha=operator.alpha)
    assert again.window == pytest.approx(operator.window)
    louder = Spectra(
        measured.pumping, measured.window, 10 * measured.input, 10 * measured.output, measured.cycle
    )
    assert estimate_htf(regularised_least_squares(louder, 3, ring_down=1.95)).htf.value == pytest.approx(
        estimate_htf(operator).htf.value
    )


def test_standard_deviations_are_those_of_repeated_noise(measured, plant) -> None:
    """White noise on the output spectrum: the scatter of Ĝ_0 near the resonance against the stated deviation."""
    rng = np.random.default_rng(5)
    operator = regularised_least_squares(measured, 1, ring_down=1.95)
    clean = np.einsum("hn,hn->n", operator.shifted, operator.model_htf(plant.htf))
    half = len(operator.bins) // 2
    level = 3e-3 * np.abs(clean).max()
    at = np.argmin(np.abs(operator.frequency - 2.0))
    found, stated = [], []
    for _ in range(60):
        noise = level * (rng.standard_normal(half) + 1j * rng.standard_normal(half))
        output = clean.copy()
        output[half + 1 :] += noise
        spoiled = Spectra(
            measured.pumping, measured.window, measured.input,
            np.concatenate([[0.0], output[half + 1 :], np.zeros(len(measured.input) - half - 1)]), measured.cycle,
        )  # fmt: skip
        one = estimate_htf(regularised_least_squares(spoiled, 1, ring_down=1.95))
        found.append(one.htf.value[one.htf.row(0), at - half - 1])
        assert one.htf.std is not None
        stated.append(one.htf.std[one.htf.row(0), at - half - 1])
    scatter = np.sqrt(np.mean(np.abs(np.array(found) - np.mean(found)) ** 2))
    assert np.mean(stated) == pytest.approx(scatter, rel=0.25)


def test_what_the_input_does_not_reach_is_told(measured) -> None:
    found = estimate_htf(regularised_least_squares(measured, 3, ring_down=1.95))
    row = found.htf.row(-1)
    assert not found.reached[row, found.htf.frequency > 7.0].any()  # its input would be beyond 8 Hz
    assert found.reached[row, (found.htf.frequency > 0.2) & (found.htf.frequency < 5.5)].all()
