"""HTFs from data by regularised least squares: the paper's equation (5).

    Ĝ = (Uᴴ U + α (D²)ᵀ D²)⁻¹ Uᴴ Y

Each frequency bin gives one equation, Y_l = Σ_m G_m(jω_l) U_{l−mP}, with 2M + 1 unknowns. The second difference D²
along frequency couples neighbouring bins (A. Siddiqi, Identification of the Harmonic Transfer Functions of a
Helicopter Rotor, MSc thesis, MIT, 2001). With the unknowns ordered bin by bin the matrix is banded and is
factorised once.

**Choice of α.** The penalty acts as a window on the impulse response, ĝ(t) = g(t) / [1 + (t/t_c)⁴] with
t_c = (⟨|U|²⟩/α)^{1/4} / (2πΔf), ⟨⟩ the mean over bins and Δf their width. So α is set by a time t_c, which has the
same meaning for records of any length and excitations of any size. It is chosen as 12 ring-down times τ of the
machine. The peak of a resonance then loses 24 (τ/t_c)⁴ ≈ 0.1 %, and noise later than t_c, where there is no
response, is suppressed. `smooth` predicts the loss: it is the same operator applied to a model. A machine may be over
with its ring-down before the band resolves it, even so fast that the rest after one period is no number any more (τ =
0). Then t_c is the shortest time that the band resolves.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cho_solve_banded, cholesky_banded

from rhythmid.errors import InputError
from rhythmid.ltp.htf import HarmonicTransferFunctions
from rhythmid.ltp.spectra import Spectra

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]
RING_DOWNS = 12.0  # t_c / τ
HAT = np.pi / np.sqrt(2.0)  # ∫ dt / (1 + t⁴): effective length of the window, in t_c
PROBES = 24  # random outputs used to measure the noise gain
REACHED = 0.01  # share of the greatest mean input power below which a harmonic is not excited


@dataclass(frozen=True, eq=False)
class RegularisedLeastSquares:
    """Equation (5) for one excitation: the matrix of its normal equations, factorised.

    `harmonics` m (h,); `bins` l (n,) from −L to L; `shifted` U_{l−mP} (h, n), zero in the limit cycle's bins; `factor`
    the banded Cholesky factor; `window` t_c [s]; `alpha` α in the units of |U|² [unit² s²].
    """

    spectra: Spectra
    harmonics: NDArray[np.int64]
    bins: NDArray[np.int64]
    shifted: Complex
    factor: Complex
    window: float
    alpha: float

    def solve(self, output: Complex) -> Complex:
        """Ĝ of equation (5) from Y in the bins (n,); shape (h, n)."""
        return self._solved(self.shifted.conj() * output[None, :])

    def _solved(self, right: Complex) -> Complex:
        """Solution of the normal equations for a right-hand side (h, n)."""
        return cho_solve_banded((self.factor, True), right.T.ravel()).reshape(-1, len(self.harmonics)).T

    def smooth(self, htf: Complex) -> Complex:
        """Estimate by (5) if G_m (h, n) were the true functions: its smoothing bias, exactly."""
        return self.solve(np.einsum("hn,hn->n", self.shifted, htf))

    @property
    def frequency(self) -> Array:
        """Frequencies of the bins [Hz], (n,)."""
        return self.bins.astype(float) * self.spectra.resolution

    @property
    def positive(self) -> NDArray[np.bool_]:
        """Bins of positive frequency, (n,)."""
        return self.bins > 0

    def model_htf(self, htf: Callable[[NDArray[np.int64], Array], Complex]) -> Complex:
        """G_m (h, n) of a model in all bins from `htf(harmonics, frequency)`, evaluated at positive frequencies and
        extended by G_−m(−jω) = conj G_m(jω)."""
        right = htf(self.harmonics, self.frequency[self.bins >= 0])
        return np.hstack([right[::-1, :0:-1].conj(), right])

    @cached_property
    def power(self) -> Array:
        """Mean input power (h, n) around each bin, over the bins that the window couples [unit² s²]."""
        return self._around(np.abs(self.shifted) ** 2)

    def _around(self, values: Array) -> Array:
        """Mean of values (h, n) over the bins that the window couples."""
        tied = round(1.0 / (2.0 * self.window * self.spectra.resolution))
        wide = min(max(1, tied), (values.shape[1] - 1) // 2)  # no wider than the band
        kernel = np.ones(2 * wide + 1)
        return np.array([np.convolve(row, kernel, mode="same") for row in values]) / np.convolve(
            np.ones(values.shape[1]), kernel, mode="same"
        )

    @cached_property
    def noise_gain(self) -> tuple[Array, float]:
        """Standard deviation of Ĝ (h, n) for white noise of unit deviation in every bin of Y, and the number of
        degrees of freedom of (5), both measured with random outputs (M. F. Hutchinson, Commun. Stat. 19 (1990)
        433)."""
        rng = np.random.default_rng(0)
        half = len(self.bins) // 2
        used = np.any(self.shifted != 0.0, axis=0)
        variance, taken = np.zeros(self.shifted.shape), 0.0
        for _ in range(PROBES):
            right = (rng.standard_normal(half) + 1j * rng.standard_normal(half)) / np.sqrt(2.0)
            output = np.where(used, np.concatenate([right[::-1].conj(), [0.0], right]), 0.0)
            found = self.solve(output)
            variance += np.abs(found) ** 2 / PROBES
            taken += np.vdot(output, np.einsum("hn,hn->n", self.shifted, found)).real / PROBES
        return np.sqrt(self._around(variance)), float(np.clip(taken, 0.0, used.sum() - 1.0))

    def bias(self, found: Complex) -> Array:
        """Standard deviation (h, n) of the smoothing bias for functions with the curvature of `found` (h, n).

        The estimate is off by −α (Uᴴ U + α (D²)ᵀ D²)⁻¹ (D²)ᵀ D² G. The second differences of G are taken as random,
        of the same size as those of the estimate around each bin. So errors that no input resolves are included (G.
        Wahba, J. R. Stat. Soc. B 45 (1983) 133; D. Nychka, J. Am. Stat. Assoc. 83 (1988) 1134: such bands cover on
        average over frequency).
        """
        bends = np.abs(np.diff(found, 2, axis=1)) ** 2
        size = np.sqrt(self._around(np.pad(bends, ((0, 0), (1, 1)), mode="edge")))[:, 1:-1]
        rng = np.random.default_rng(0)
        variance = np.zeros(found.shape)
        for _ in range(PROBES):
            real, imaginary = rng.standard_normal((2, *size.shape))
            drawn = np.pad(size * (real + 1j * imaginary) / np.sqrt(2.0), ((0, 0), (2, 2)))
            variance += np.abs(self._solved(np.diff(drawn, 2, axis=1))) ** 2 / PROBES
        return self.alpha * np.sqrt(self._around(variance))

    @cached_property
    def spacing(self) -> int:
        """Distance between bins that the input excites."""
        live = np.abs(self.spectra.input) > 1e-3 * np.abs(self.spectra.input).max()
        gaps = np.diff(np.flatnonzero(live))
        return int(np.median(gaps)) if len(gaps) else 1

    @property
    def reached(self) -> NDArray[np.bool_]:
        """Where the input excites harmonic m at bin l, (h, n)."""
        return self.power > REACHED * np.median(self.power[self.power > REACHED * self.power.max()])


def regularised_least_squares(
    spectra: Spectra,
    harmonics: int = 3,
    window: float | None = None,
    ring_down: float = 1.0,
    alpha: float | None = None,
) -> RegularisedLeastSquares:
    """Set up and factorise equation (5) for `harmonics` M, that is m = −M … M.

    The smoothing is given as the time `window` t_c [s], or follows from the machine's `ring_down` [s], or is given
    directly as `alpha`. Raises InputError when the record has no excitation.
    """
    low, high = spectra.band
    m = np.arange(-harmonics, harmonics + 1)
    last = min(
        round((high + harmonics * spectra.pumping.frequency) / spectra.resolution), len(spectra.input) - 1
    )
    bins = np.arange(-last, last + 1)
    shifted = spectra.shifted_input(m, bins)
    shifted[:, bins % spectra.window.periods == 0] = 0.0  # the limit cycle's own bins
    mean = float(
        np.mean(np.abs(spectra.input[(spectra.frequency >= low) & (spectra.frequency <= high)]) ** 2)
    )
    if alpha is None:
        # a band up to `high` resolves no shorter time
        t_c = window or max(RING_DOWNS * ring_down, 0.5 / high)
        alpha = mean / (2.0 * np.pi * spectra.resolution * t_c) ** 4
    else:
        t_c = (mean / alpha) ** 0.25 / (2.0 * np.pi * spectra.resolution)
    h, n = shifted.shape
    band = np.zeros((2 * h + 1, h * n), dtype=complex)  # lower form: band[i − j, j]
    for row in range(h):
        for column in range(row + 1):
            band[row - column, column::h] += shifted[row].conj() * shifted[column]
    diagonal = np.full(n, 6.0)
    diagonal[[0, -1]], diagonal[[1, -2]] = 1.0, 5.0
    first = np.full(n - 1, -4.0)
    first[[0, -1]] = -2.0
    tiny = 1e-12 * mean  # without excitation, a straight line is still undetermined
    band[0] += np.repeat(alpha * diagonal, h) + tiny
    band[h, : h * (n - 1)] += np.repeat(alpha * first, h)
    band[2 * h, : h * (n - 2)] += alpha
    try:
        factor = cholesky_banded(band, lower=True)
    except np.linalg.LinAlgError:
        raise InputError(
            "the excitation does not determine the transfer functions; excite more frequencies"
        ) from None
    return RegularisedLeastSquares(spectra, m, bins, shifted, factor, float(t_c), float(alpha))


@dataclass(frozen=True, eq=False)
class HtfEstimate:
    """HTFs estimated by equation (5).

    Attributes
    ----------
    htf : Ĥ_m at positive frequencies, with standard deviations from the residual.
    reached : bool[h, n], where the input excites them.
    operator : the equation that was solved, for its smoothing bias.
    noise : standard deviation of Y in a bin [unit s], from the residual.
    solution : Ĝ_m in all bins, of either sign.
    """

    htf: HarmonicTransferFunctions
    reached: NDArray[np.bool_]
    operator: RegularisedLeastSquares
    noise: float
    solution: Complex

    @property
    def bias(self) -> Array:
        """Standard deviation (h, n) of the smoothing bias, at positive frequencies."""
        return self.operator.bias(self.solution)[:, self.operator.positive]


def estimate_htf(operator: RegularisedLeastSquares) -> HtfEstimate:
    """Solve equation (5) for the record whose spectra the operator holds."""
    output = operator.spectra.output_at(operator.bins)
    found = operator.solve(output)
    used = np.any(operator.shifted != 0.0, axis=0)
    residual = np.where(used, output - np.einsum("hn,hn->n", operator.shifted, found), 0.0)
    gain, taken = operator.noise_gain
    noise = float(np.sqrt(np.sum(np.abs(residual) ** 2) / (used.sum() - taken)))
    keep = operator.positive
    htf = HarmonicTransferFunctions(
        operator.harmonics, operator.frequency[keep], found[:, keep], noise * gain[:, keep]
    )
    return HtfEstimate(htf, operator.reached[:, keep], operator, noise, found)
