"""Input and measurement delay from the phase of HTFs: the paper's equations (15) and (16), harmonic by harmonic.

The phase error of harmonic m is linear in frequency with slope τ_u + τ_y and intercept −mω_p τ_u. So G_0 gives only
the sum. Every other harmonic gives both delays, with τ_u known modulo T/|m|.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rhythmid.errors import InputError
from rhythmid.ltp.regularised_least_squares import HAT, HtfEstimate

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]
UPPER_LIMIT_OF_INTEGRAL = 40.0  # [rad/s] upper limit of the integral in (16)
LEAST_BINS = 4  # bins needed to fit a phase
LARGEST = 1.0  # [s] largest sum of the delays that is searched


@dataclass(frozen=True)
class DelayEstimate:
    """Delays [s] with standard deviations. `input` and `measurement` are None where only their `sum` is identifiable.

    `aliases` are further nonnegative pairs (τ_u, τ_y) with the same phases. `error` is the root of the integral in (16).
    """

    sum: float
    sum_std: float
    input: float | None = None
    input_std: float | None = None
    measurement: float | None = None
    measurement_std: float | None = None
    aliases: tuple[tuple[float, float], ...] = ()
    error: float = 0.0

    def to_dict(self) -> dict[str, float]:
        """{"sum": …} for harmonic 0, {"input": …, "measurement": …} for the others, in seconds."""
        if self.input is None or self.measurement is None:
            return {"sum": self.sum}
        return {"input": self.input, "measurement": self.measurement}


@dataclass(frozen=True)
class _Phase:
    """Phase errors at τ = 0 [rad] (n,), frequency ω (n,), offset mω_p (n,) [rad/s] and weights (n,)."""

    error: Array
    omega: Array
    offset: Array
    weight: Array

    def left(self, input_delay: float, measurement_delay: float) -> Array:
        """Paper, equation (15), wrapped to (−π, π]: ∠G_err = ∠G_m − ∠Ĝ_m − [(ω − mω_p) τ_u + ω τ_y].

        The bracket is subtracted, as (9) demands: ∠Ĝ_m is smaller than ∠G_m by just that. (15) is printed with a plus.
        """
        turned = self.error - (self.omega - self.offset) * input_delay - self.omega * measurement_delay
        return np.angle(np.exp(1j * turned))

    def cost(self, input_delay: float, measurement_delay: float) -> float:
        """The sum that approximates the integral in (16)."""
        return float(np.sum((self.weight * self.left(input_delay, measurement_delay)) ** 2))

    def refine(self, delays: Array, directions: Array) -> tuple[Array, Array]:
        """Least squares for `delays` (2,) along `directions` (2, k); repeated, since the phase is wrapped.

        Returns the delays and the covariance (2, 2) for phase errors of variance 1 / weight².
        """
        columns = -np.stack([self.omega - self.offset, self.omega], axis=1) @ directions
        weighted = self.weight[:, None] * columns
        for _ in range(20):
            step = np.linalg.lstsq(weighted, -self.weight * self.left(*delays), rcond=1e-12)[0]
            delays = delays + directions @ step
            if np.abs(step).max() < 1e-12:
                break
        inverse = directions @ np.linalg.pinv(weighted.T @ weighted, rcond=1e-12) @ directions.T
        return delays, inverse


BOTH = np.eye(2)
INPUT_ALONE = np.array([[1.0], [0.0]])
MEASUREMENT_ALONE = np.array([[0.0], [1.0]])


def _legible(estimate: HtfEstimate, m: int) -> NDArray[np.bool_]:
    """Bins of harmonic m that the excitation reaches, up to the limit of (16); all bins where the machine works
    above that limit."""
    reached = estimate.reached[estimate.htf.row(m)]
    below = reached & (2.0 * np.pi * estimate.htf.frequency <= UPPER_LIMIT_OF_INTEGRAL)
    return below if below.sum() >= LEAST_BINS else reached


def shows_delays(estimate: HtfEstimate, m: int) -> bool:
    """Whether the excitation reaches harmonic m at enough frequencies to estimate delays from its phase."""
    return bool(_legible(estimate, m).sum() >= LEAST_BINS)


def _phase(estimate: HtfEstimate, model: Complex, m: int, weigh_by_noise: bool = False) -> _Phase:
    row = estimate.htf.row(m)
    measured = estimate.htf.value[row]
    omega = 2.0 * np.pi * estimate.htf.frequency
    used = _legible(estimate, m)
    if used.sum() < LEAST_BINS:
        raise InputError(f"the excitation does not reach harmonic {m}: no delay can be read from its phase")
    weight = np.abs(measured)
    if weigh_by_noise:
        assert estimate.htf.std is not None
        weight = weight / estimate.htf.std[row]
    omega_p = estimate.operator.spectra.pumping.omega
    error = np.angle(model[row]) - np.angle(measured)
    return _Phase(error[used], omega[used], np.full(used.sum(), m * omega_p), weight[used])


def _start(phase: _Phase, offset: bool) -> tuple[float, float]:
    """Slope τ_u + τ_y [s] and intercept mω_p τ_u [rad] that align the phasors best, by a search over the slope."""
    slopes = np.arange(-0.1, LARGEST, 0.1 / np.ptp(phase.omega))
    phasors = phase.weight**2 * np.exp(1j * phase.error)
    total = np.exp(-1j * np.multiply.outer(slopes, phase.omega)) @ phasors
    best = int(np.argmax(np.abs(total) if offset else total.real))
    return float(slopes[best]), float(-np.angle(total[best])) if offset else 0.0


def _independent(estimate: HtfEstimate) -> float:
    """Number of independent bins: the smoothing of (5) correlates the noise of neighbouring bins."""
    operator = estimate.operator
    return max(1.0, 1.0 / (HAT * operator.window * operator.spectra.resolution))


def _scatter(estimate: HtfEstimate, phase: _Phase, delays: Array, fitted: int) -> float:
    bins = len(phase.omega) / _independent(estimate)
    return phase.cost(*delays) / max(1.0, bins - fitted)


def fit_delays(estimate: HtfEstimate, model: Complex, m: int) -> DelayEstimate:
    """Paper, equation (16): (τ_u, τ_y) that minimise √∫₀⁴⁰ (|Ĝ_m| ∠G_err)² dω, from harmonic m alone.

    `model` (h, n) are the parametric model's HTFs at the estimate's frequencies. Only nonnegative delays are sought.
    Raises InputError where the excitation does not reach the harmonic.
    """
    phase = _phase(estimate, model, m)
    slope, intercept = _start(phase, offset=m != 0)
    step = 2.0 * np.pi * estimate.operator.spectra.resolution
    if m == 0:
        delays, inverse = phase.refine(np.array([slope, 0.0]), INPUT_ALONE)
        if delays[0] < 0.0:
            delays = np.zeros(2)
        std = math.sqrt(inverse[0, 0] * _scatter(estimate, phase, delays, 1))
        return DelayEstimate(float(delays[0]), std, error=math.sqrt(phase.cost(*delays) * step))
    omega_p = estimate.operator.spectra.pumping.omega
    alias = 2.0 * np.pi / (abs(m) * omega_p)
    first = (intercept / (m * omega_p)) % alias
    free, inverse = phase.refine(np.array([first, slope - first]), BOTH)
    pairs = [free + n * alias * np.array([1.0, -1.0]) for n in range(-2, 2 + math.ceil(LARGEST / alias))]
    chosen = min(pairs, key=lambda pair: (round(float(np.sum(np.maximum(-pair, 0.0))), 9), pair[0]))
    delays = chosen
    if np.any(delays < 0.0):  # delays are causal: take the optimum on the boundary
        edges = [
            phase.refine(np.array([0.0, max(0.0, chosen.sum())]), MEASUREMENT_ALONE)[0],
            phase.refine(np.array([max(0.0, chosen.sum()), 0.0]), INPUT_ALONE)[0],
            np.zeros(2),
        ]
        delays = min((e for e in edges if np.all(e >= 0.0)), key=lambda e: phase.cost(*e))
    covariance = inverse * _scatter(estimate, phase, chosen, 2)
    others = tuple((float(p[0]), float(p[1])) for p in pairs if p is not chosen and np.all(p >= 0.0))
    return DelayEstimate(
        float(delays.sum()), math.sqrt(float(np.ones(2) @ covariance @ np.ones(2))),
        float(delays[0]), math.sqrt(covariance[0, 0]), float(delays[1]), math.sqrt(covariance[1, 1]),
        others, math.sqrt(phase.cost(*delays) * step),
    )  # fmt: skip


def combine_delays(
    estimate: HtfEstimate, model: Complex, harmonics: Sequence[int], start: tuple[float, float]
) -> DelayEstimate:
    """(τ_u, τ_y) that satisfy (9) for several harmonics together, each phase weighted by its noise."""
    phases = [_phase(estimate, model, m, weigh_by_noise=True) for m in harmonics]
    joined = _Phase(
        *(
            np.concatenate([getattr(p, name) for p in phases])
            for name in ("error", "omega", "offset", "weight")
        )
    )
    delays, inverse = joined.refine(np.array(start), BOTH)
    covariance = inverse * _scatter(estimate, joined, delays, 2)
    return DelayEstimate(
        float(delays.sum()), math.sqrt(float(np.ones(2) @ covariance @ np.ones(2))),
        float(delays[0]), math.sqrt(covariance[0, 0]), float(delays[1]), math.sqrt(covariance[1, 1]),
    )  # fmt: skip
