"""HTFs from dense excitations: the local rational method, with transients and leakage as separate terms.

Around each output frequency all 2M + 1 transfer functions and the transient are low-order polynomials over one
common first-order denominator, because all of them have the poles of the same time-periodic machine:

    (1 + a r) Y_{l+r} = Σ_m Σ_s b_{ms} r^s U_{l+r−mP} + Σ_s t_s r^s + noise,    r = −n … n

(T. McKelvey, G. Guérin, Nonparametric frequency response estimation using a local rational model, SYSID 2012; the
polynomial form for time-periodic systems: E. Louarroudi, R. Pintelon, J. Lataire, IEEE TIM 61(5), 2012.) The
denominator multiplies noisy data, which would bias it. So the equations are solved again with the predicted output
as instrumental variable. The residual of the equations contains noise and distortion.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.stats import f as f_distribution

from rhythmid.ltp.error_levels import MANY, local_level
from rhythmid.ltp.excited_lines import ExcitedLines
from rhythmid.ltp.harmonic_estimate import HarmonicEstimate

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]
ORDER = 2  # order of the polynomials
FREEDOM = 20  # degrees of freedom left for the error
ROUNDS = 3  # solutions with instrumental variables
MOST_LOCAL_HARMONICS = 3  # largest M
# largest half-width of a window, as a multiple of the resonance's half-width
WIDEST = 2.5
RANK = 1e-6  # singular value, relative to the largest, below which a combination is not identifiable
POOR = 100.0  # ratio to the usual variance above which a value is not reported
NEEDED = 1e-3  # significance level for using a denominator
UNSTABLE = 0.05  # least magnitude of the denominator
# leakage below which the excitation counts as periodic, so that bins off its lattice contain only noise
LEAKAGE = 0.02
POINTS = 500  # largest number of frequencies at which the functions are estimated


def half_window(harmonics: int) -> int:
    """n: number of bins on either side that leaves enough degrees of freedom for M = `harmonics`."""
    unknowns = (2 * harmonics + 2) * (ORDER + 1) + 1
    return -(-(unknowns + FREEDOM) // 2)


def highest_local(lines: ExcitedLines, ring_down: float, highest: int = MOST_LOCAL_HARMONICS) -> int | None:
    """Largest M whose window is narrow relative to a resonance with this `ring_down` [s]; None if there is none."""
    least = 1 if lines.periods else 0
    step = bin_step(lines) * lines.spectra.resolution
    for harmonics in range(min(highest, lines.farthest), least - 1, -1):
        if half_window(harmonics) * step <= WIDEST / (2.0 * np.pi * max(ring_down, 1e-9)):
            return harmonics
    return None


def bin_step(lines: ExcitedLines) -> int:
    """Distance between the bins that are used."""
    return lines.lattice if lines.spectra.window.leakage < LEAKAGE else 1


def _targets(lines: ExcitedLines) -> NDArray[np.int64]:
    """Bins at which the functions are estimated."""
    usable = np.flatnonzero(lines.within)
    usable = usable[usable % bin_step(lines) == 0]
    return usable[:: max(1, -(-len(usable) // POINTS))]


def oversampling(lines: ExcitedLines, harmonics: int) -> int:
    """Number of neighbouring estimates from the same data."""
    targets = _targets(lines)
    apart = float(np.median(np.diff(targets))) if len(targets) > 1 else 1.0
    return max(1, int(np.ceil((2 * half_window(harmonics) + 1) * bin_step(lines) / apart)))


def local_rational(lines: ExcitedLines, harmonics: int) -> tuple[HarmonicEstimate, ...]:
    """H_m for m = −M … M (`harmonics`) around the frequencies that the excitation reaches."""
    spectra, step, half = lines.spectra, bin_step(lines), half_window(harmonics)
    m = np.arange(-harmonics, harmonics + 1)
    targets = _targets(lines)
    r = np.arange(-half, half + 1)
    bins = targets[:, None] + step * r
    inside = np.abs(bins) < len(spectra.output)
    if lines.periods:
        inside &= bins % lines.periods != 0
    place = np.where(inside, bins, 0)
    output = np.where(inside, spectra.output_at(place.ravel()).reshape(place.shape), 0.0)
    source = spectra.shifted_input(m, place.ravel()).reshape(len(m), *place.shape)
    powers = (r / half)[:, None] ** np.arange(ORDER + 1)
    transient = np.broadcast_to(powers, (*place.shape, ORDER + 1))
    regressors = np.concatenate([*(one[:, :, None] * powers for one in source), transient], axis=2)
    regressors = np.where(inside[:, :, None], regressors, 0.0)
    value, variance, error, freedom = _solve(regressors, output, r / half, inside.sum(axis=1))
    quiet = _quiet_power(lines, targets)
    made = []
    for index, harmonic in enumerate(m):
        column = index * (ORDER + 1)
        good = _near_lines(lines, int(harmonic))[targets] & np.isfinite(variance[:, column]) & (freedom > 1)
        if good.any():
            good &= variance[:, column] < POOR * np.median(variance[good, column])
        std: Array = np.sqrt(variance[good, column] * error[good])
        unknown: Array = np.full(int(good.sum()), np.nan)
        frequency: Array = targets[good].astype(float) * spectra.resolution
        noise: Array = np.sqrt(variance[good, column] * quiet[good])
        made.append(
            HarmonicEstimate(
                int(harmonic), frequency, value[good, column], std, freedom[good], noise, unknown, unknown,
                unknown,
            )
        )  # fmt: skip
    return tuple(made)


def _near_lines(lines: ExcitedLines, m: int) -> NDArray[np.bool_]:
    """Bins around which harmonic m has strong lines, so that its function can be estimated."""
    near = lines.reaching(m, lines.strong).astype(float)
    wide = 2 * bin_step(lines) + 1
    return np.convolve(near, np.ones(wide), mode="same") > 0.5


def _quiet_power(lines: ExcitedLines, targets: NDArray[np.int64]) -> Array:
    """Mean |Y|² around the targets in bins with noise only; NaN where the excitation does not repeat."""
    if lines.quiet.sum() < MANY or bin_step(lines) == 1:
        return np.full(len(targets), np.nan)
    return local_level(np.abs(lines.spectra.output) ** 2, lines.quiet, MANY).power[targets]


@dataclass(frozen=True, eq=False)
class _Windows:
    """Solution of all windows: unknowns `value` (w, q), `sensitivity` (w, rows, …) of the output to them, and the sum of
    squares `left` (w,)."""

    value: Complex
    sensitivity: Complex
    left: Array


def _solve(
    regressors: Complex, output: Complex, r: Array, rows: NDArray[np.int64]
) -> tuple[Complex, Array, Array, Array]:
    """Solve each window; regressors (w, rows, q), output (w, rows).

    Returns values (w, q) at r = 0, their variance for an error of unit variance (inf where not identifiable), the
    error's variance (w,), and its degrees of freedom (w,). The denominator is used only where polynomials leave a
    significant residual: with noise alone, a pole would fit the noise.
    """
    size = np.linalg.norm(regressors, axis=1)
    size[size == 0.0] = 1.0
    scaled = regressors / size[:, None, :]
    plain, poled = _polynomial(scaled, output), _rational(scaled, output, r)
    value = (plain.value / size).astype(complex)
    variance, known = _variance(plain.sensitivity, scaled.shape[2])
    freedom, left = rows - known, plain.left
    other_variance, other_known = _variance(poled.sensitivity, scaled.shape[2])
    other_freedom = rows - other_known
    gain = (left - poled.left) / np.maximum(poled.left / np.maximum(other_freedom, 1), 1e-300)
    needed = (gain > f_distribution.isf(NEEDED, 2, 2 * np.maximum(other_freedom, 1))) & (other_freedom > 1)
    value[needed] = (poled.value / size)[needed]
    variance[needed], left[needed], freedom[needed] = (
        other_variance[needed],
        poled.left[needed],
        other_freedom[needed],
    )
    return value, variance / size**2, left / np.maximum(freedom, 1), freedom.astype(float)


def _polynomial(scaled: Complex, output: Complex) -> _Windows:
    """Least squares without a denominator."""
    value = np.einsum("wqr,wr->wq", np.linalg.pinv(scaled, rcond=RANK), output)
    predicted = np.einsum("wrq,wq->wr", scaled, value)
    return _Windows(value, scaled, np.sum(np.abs(output - predicted) ** 2, axis=1))


def _rational(scaled: Complex, output: Complex, r: Array) -> _Windows:
    """Instrumental variables with a denominator 1 + a r."""
    level = np.linalg.norm(output, axis=1)
    level[level == 0.0] = 1.0
    q = scaled.shape[2]

    def joined(predicted: Complex) -> Complex:
        return np.concatenate([scaled, -(predicted * r / level[:, None])[:, :, None]], axis=2)

    equations = joined(output)
    solution = np.einsum("wqr,wr->wq", np.linalg.pinv(equations, rcond=RANK), output)
    bottom = _denominator(solution[:, q] / level, r)
    for _ in range(ROUNDS):
        predicted = np.einsum("wrq,wq->wr", scaled, solution[:, :q]) / bottom
        instruments = (joined(predicted) / bottom[:, :, None]).conj().transpose(0, 2, 1)
        left = instruments @ (equations / bottom[:, :, None])
        right = np.einsum("wqr,wr->wq", instruments, output / bottom)
        solution = np.einsum("wpq,wq->wp", np.linalg.pinv(left, rcond=RANK**2), right)
        bottom = _denominator(solution[:, q] / level, r)
    predicted = np.einsum("wrq,wq->wr", scaled, solution[:, :q]) / bottom
    sensitivity = joined(predicted) / bottom[:, :, None]
    return _Windows(solution[:, :q], sensitivity, np.sum(np.abs(output - predicted) ** 2, axis=1))


def _variance(sensitivity: Complex, q: int) -> tuple[Array, NDArray[np.int64]]:
    """Variances (w, q) of the first q unknowns for an error of unit variance, inf where not identifiable; and the
    number of identifiable combinations (w,)."""
    _, singular, right = np.linalg.svd(sensitivity, full_matrices=False)
    known = singular > RANK * singular[:, :1]
    weight = np.abs(right) ** 2
    inverse = np.where(known, 1.0 / np.where(known, singular, 1.0) ** 2, 0.0)
    variance = np.sum(inverse[:, :, None] * weight, axis=1)
    lost = np.sum(np.where(known, 0.0, 1.0)[:, :, None] * weight, axis=1) > 1e-3
    return np.where(lost, np.inf, variance)[:, :q], known.sum(axis=1)


def _denominator(a: Complex, r: Array) -> Complex:
    """1 + a r, limited away from zero."""
    bottom = 1.0 + a[:, None] * r
    size = np.abs(bottom)
    return np.where(size < UNSTABLE, UNSTABLE * bottom / np.maximum(size, 1e-12), bottom)
