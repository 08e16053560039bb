"""Coloured noise: an autoregressive model of residuals, and its whitening filter.

P. Stoica, R. Moses, Spectral Analysis of Signals, 2005, section 3.4 (Levinson-Durbin recursion). With coloured
noise taken for white, every test gives false alarms. After whitening, least squares is the maximum-likelihood
estimate.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter, lfiltic

Array = NDArray[np.float64]
HIGHEST_ORDER = 24  # of an autoregressive model
TINY = 1e-12  # least share of the variance that a predictor leaves
PREDICTED = 25.0  # ratio of a residual's power to that of its innovations above which it is not noise


@dataclass(frozen=True)
class NoiseModel:
    """n_k = Σ_i a_i n_{k−i} + e_k with `coefficients` a (p,) and innovations e of standard deviation `std`."""

    coefficients: Array
    std: float

    @property
    def order(self) -> int:
        return len(self.coefficients)

    @property
    def variance(self) -> float:
        """Variance of the noise n_k."""
        if self.order == 0:
            return self.std**2
        response = 1.0 - np.fft.rfft(np.concatenate([[0.0], self.coefficients]), 4096)
        return float(self.std**2 * np.mean(1.0 / np.abs(response) ** 2))

    @property
    def is_structure(self) -> bool:
        """Whether this is motion that a model misses rather than noise: nearly all of it is predictable from its
        own past."""
        return self.variance > PREDICTED * self.std**2

    @property
    def predictable(self) -> float:
        """Share of the rms that is predictable from the noise's own past; 0 for white noise."""
        return float(np.sqrt(max(1.0 - self.std**2 / self.variance, 0.0)))

    @property
    def long_run_variance(self) -> float:
        """Spectral density at zero frequency, which determines the scatter of long averages of the noise."""
        return float(self.std**2 / (1.0 - self.coefficients.sum()) ** 2)

    @cached_property
    def _beginnings(self) -> tuple[tuple[Array, float], ...]:
        """Predictors of the orders 0 … p − 1 with the standard deviations of their innovations, by the recursion
        run backwards."""
        found: list[tuple[Array, float]] = []
        a, std = self.coefficients, self.std
        while len(a):
            reflection = float(a[-1])
            rest = max(1.0 - reflection**2, TINY)
            a, std = (a[:-1] + reflection * a[-2::-1]) / rest, std / rest**0.5
            found.append((a, std))
        return tuple(reversed(found))

    def whiten(self, samples: Array) -> Array:
        """Innovations in units of their standard deviations; (n,) or (n, q) of the same shape.

        The first p samples are predicted from the samples that precede them, however few. So the sum of squares is
        that of the exact likelihood, and every part of a stretch counts.
        """
        p, n = self.order, len(samples)
        white = np.empty_like(samples, dtype=float)
        for k, (predictor, std) in enumerate(self._beginnings[:n]):
            white[k] = (samples[k] - predictor @ samples[:k][::-1]) / std
        if n <= p:
            return white
        after = samples[p:].astype(float)
        for lag, coefficient in enumerate(self.coefficients, start=1):
            after -= coefficient * samples[p - lag : n - lag]
        white[p:] = after / self.std
        return white

    def colour(self, white: Array) -> Array:
        """The samples (n,) whose innovations these are: the inverse of `whiten`."""
        p, n = self.order, len(white)
        samples = np.empty(n)
        for k, (predictor, std) in enumerate(self._beginnings[:n]):
            samples[k] = std * white[k] + predictor @ samples[:k][::-1]
        if n > p:
            denominator = np.concatenate([[1.0], -self.coefficients])
            state = lfiltic([1.0], denominator, samples[:p][::-1])
            samples[p:] = lfilter([1.0], denominator, self.std * white[p:], zi=state)[0]
        return samples


def runs(used: NDArray[np.bool_]) -> list[slice]:
    """Slices of contiguous True values."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], used.astype(np.int8), [0]])))
    return [slice(int(a), int(b)) for a, b in zip(edges[::2], edges[1::2])]


def estimate_noise(residuals: Sequence[Array], floor: float = 1e-300) -> NoiseModel:
    """Autoregressive model of residual stretches (n_i,); the Bayesian information criterion selects the order."""
    stretches = [r for r in residuals if len(r) > 8]
    total = sum(len(r) for r in stretches)
    if total == 0:
        return NoiseModel(np.empty(0), max(floor, 1e-300))
    highest = int(min(HIGHEST_ORDER, total // 20, min(len(r) for r in stretches) // 2))
    covariance = np.zeros(highest + 1)
    for r in stretches:
        for lag in range(highest + 1):
            covariance[lag] += float(r[lag:] @ r[: len(r) - lag])
    covariance /= total
    if covariance[0] <= floor**2:
        return NoiseModel(np.empty(0), max(floor, 1e-300))
    best, best_score = NoiseModel(np.empty(0), float(np.sqrt(covariance[0]))), np.log(covariance[0])
    a, error = np.empty(0), covariance[0]
    for order in range(1, highest + 1):
        reflection = (covariance[order] - a @ covariance[order - 1 : 0 : -1][: order - 1]) / error
        a = np.concatenate([a - reflection * a[::-1], [reflection]])
        error *= 1.0 - reflection**2
        if error <= 0.0:
            break
        score = np.log(error) + order * np.log(total) / total
        if score < best_score:
            best, best_score = NoiseModel(a.copy(), float(np.sqrt(error))), score
    return best


def burg(stretches: Sequence[Array]) -> NoiseModel:
    """Autoregressive model of stretches (n_i,) by Burg's method; the Bayesian information criterion selects the order.

    For noise that excites a lightly damped machine. Sample covariances treat a stretch as zero beyond its ends,
    which hides such a narrow spectrum. (J. P. Burg, Maximum Entropy Spectral Analysis, thesis, Stanford 1975;
    Stoica, Moses, section 3.9.3.)
    """
    forward = backward = [one for one in stretches if len(one) > 2 * HIGHEST_ORDER]
    total = sum(len(one) for one in forward)
    error = sum(float(one @ one) for one in forward) / max(total, 1)
    if error <= 0.0:
        return NoiseModel(np.empty(0), 1e-300)
    best, least = NoiseModel(np.empty(0), float(np.sqrt(error))), np.log(error)
    a = np.empty(0)
    for order in range(1, HIGHEST_ORDER + 1):
        ahead, behind = [f[1:] for f in forward], [b[:-1] for b in backward]
        power = sum(float(f @ f + b @ b) for f, b in zip(ahead, behind))
        reflection = 2.0 * sum(float(f @ b) for f, b in zip(ahead, behind)) / max(power, 1e-300)
        a = np.concatenate([a - reflection * a[::-1], [reflection]])
        error *= 1.0 - reflection**2
        if error <= 0.0:
            break
        forward = [f - reflection * b for f, b in zip(ahead, behind)]
        backward = [b - reflection * f for f, b in zip(ahead, behind)]
        score = np.log(error) + order * np.log(total) / total
        if score < least:
            best, least = NoiseModel(a.copy(), float(np.sqrt(error))), score
    return best
