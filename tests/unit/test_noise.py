"""Colour of the noise: autoregressive models and whitening."""

import numpy as np
import pytest
from scipy.linalg import cholesky, solve_triangular, toeplitz
from scipy.signal import lfilter

from rhythmid.identify.noise import NoiseModel, estimate_noise, runs


def coloured(rng, coefficients, std, n):
    return lfilter([1.0], np.concatenate([[1.0], -np.asarray(coefficients)]), std * rng.standard_normal(n))


@pytest.mark.parametrize("coefficients", [[0.8], [1.2, -0.5], []])
def test_an_autoregressive_process_is_recovered(coefficients):
    noise = estimate_noise([coloured(np.random.default_rng(1), coefficients, 0.3, 40_000)])
    assert noise.std == pytest.approx(0.3, rel=0.02)
    assert noise.order >= len(coefficients)
    assert noise.coefficients[: len(coefficients)] == pytest.approx(coefficients, abs=0.03)


@pytest.mark.parametrize("correlation", [0.0, 0.5, 0.9])
def test_of_first_order_noise_the_correlation_follows_from_its_own_past(correlation):
    assert NoiseModel(np.array([correlation]), 0.3).predictable == pytest.approx(correlation, abs=1e-3)


def test_white_noise_gets_no_colour_in_most_draws():
    orders = [estimate_noise([np.random.default_rng(seed).standard_normal(5000)]).order for seed in range(40)]
    assert sum(order == 0 for order in orders) >= 34


def test_whitening_leaves_innovations_of_unit_variance():
    noise = NoiseModel(np.array([1.2, -0.5]), 0.3)
    white = noise.whiten(coloured(np.random.default_rng(2), [1.2, -0.5], 0.3, 50_000)[500:])
    assert np.std(white) == pytest.approx(1.0, rel=0.02)
    assert abs(np.corrcoef(white[1:], white[:-1])[0, 1]) < 0.02


def test_whitening_gives_the_sum_of_squares_of_the_exact_likelihood():
    noise = NoiseModel(np.array([1.2, -0.5]), 0.3)
    impulse = lfilter([1.0], [1.0, -1.2, 0.5], np.r_[1.0, np.zeros(400)])
    covariance = [noise.std**2 * float(impulse[k:] @ impulse[: len(impulse) - k]) for k in range(9)]
    samples = np.random.default_rng(3).standard_normal(9)
    independent = solve_triangular(cholesky(toeplitz(covariance), lower=True), samples, lower=True)
    assert noise.whiten(samples) == pytest.approx(independent, abs=1e-9)
    assert noise.whiten(samples[:1]) == pytest.approx(samples[:1] / noise.variance**0.5, rel=1e-3)


def test_variance_and_long_run_variance_match_the_closed_form_of_a_first_order_process():
    noise = NoiseModel(np.array([0.7]), 0.2)
    assert noise.variance == pytest.approx(0.04 / (1 - 0.49), rel=1e-3)
    assert noise.long_run_variance == pytest.approx(0.04 / 0.09, rel=1e-9)


def test_a_constant_residual_does_not_divide_by_zero():
    assert estimate_noise([np.zeros(100)], floor=1e-9).std == 1e-9


def test_runs_are_the_unbroken_stretches():
    used = np.array([1, 1, 0, 1, 0, 0, 1], bool)
    assert [(s.start, s.stop) for s in runs(used)] == [(0, 2), (3, 4), (6, 7)]


@pytest.mark.parametrize("length", [0, 1, 2, 3])
def test_stretches_no_longer_than_the_noise_remembers_are_whitened_as_the_beginning_of_longer_ones(length):
    model = NoiseModel(np.array([0.5, -0.2, 0.1]), 0.3)
    samples = np.random.default_rng(0).standard_normal(20)
    assert model.whiten(samples[:length]) == pytest.approx(model.whiten(samples)[:length])
