"""Maximum likelihood in the frequency domain: parameters and delays together, from harmonic transfer functions and
limit cycle.

Minimises Σ_l |Y_l − Σ_m G_m(θ) e^{−j[(ω_l − mω_p) τ_u + ω_l τ_y]} U_{l−mP}|² / σ_l² + Σ_n |X̂_n − X_n(θ) e^{−jnω_p τ_y}|² / σ_n²
over the free parameters θ and the delays (R. Pintelon, J. Schoukens, System Identification: A Frequency Domain Approach,
2nd ed., 2012, chapter 9; for time-periodic systems E. Louarroudi et al., IEEE TIM 61(5), 2012). The machine is linearised
around its limit cycle, so distortion biases it slightly; the time-domain fit of `joint` has no such bias. This form
converges from starting values that are far off. It is also an independent check.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares
from threadpoolctl import threadpool_limits

from rhythmid.errors import InputError
from rhythmid.ltp.htf import ORDER, LinearisedModel, linearised
from rhythmid.ltp.pumping import Pumping
from rhythmid.ltp.spectra import Spectra, spectra
from rhythmid.model import Model
from rhythmid.record.record import Record
from rhythmid.simulation.right_hand_side import InputKind
from rhythmid.simulation.transport import INPUT_DELAY, MEASUREMENT_DELAY

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]
DELAYS = (INPUT_DELAY, MEASUREMENT_DELAY)
CYCLE = 4  # number of harmonics of the limit cycle that are used
PARTS = 8  # parts of the record, whose spread gives the disturbance of the limit cycle
LINES = 1500  # number of spectral lines used in a search
LONGEST_DELAY = 0.5  # [s] largest delay searched on either side
SIDEBANDS = 3  # number on either side that are compared
TIME = 0.02  # [s] scale of a delay that starts at zero
UNEXPLAINED_NEAR_OPTIMUM = 0.05  # unexplained share of the power below which a descent converges by itself
FACTORS = np.geomspace(0.4, 2.5, 25)  # grid for each parameter when a search starts far from the optimum


@dataclass(frozen=True, eq=False)
class HarmonicFit:
    """Parameters `names` (the delays last) with `values` and `covariance`. `misfit` is the unexplained share (rms)
    of the response to the command, `expected` complex128[n] the predicted response at the `bins`."""

    model: Model
    names: tuple[str, ...]
    values: Array
    covariance: Array
    misfit: float
    bins: NDArray[np.int64]
    expected: Complex

    @property
    def std(self) -> dict[str, float]:
        """Standard deviation of each estimate, by the Cramér-Rao bound."""
        return {n: float(math.sqrt(max(v, 0.0))) for n, v in zip(self.names, np.diag(self.covariance))}


class _Comparison:
    """Spectra of a record beside those of a model."""

    def __init__(self, record: Record, model: Model, pumping: Pumping, cycle: bool, ring_down: float) -> None:
        self.model, self.pumping = model, pumping
        self.kind: InputKind = record.input_kind
        self.cycle = cycle and pumping.active
        self.names = [n for n in model.free if n not in DELAYS]
        self.m = np.arange(-SIDEBANDS, SIDEBANDS + 1) if pumping.active else np.zeros(1, dtype=np.int64)
        self.spectra: Spectra = spectra(record, pumping, ring_down, SIDEBANDS + 1)
        self._guess: Array | None = None
        self._last: tuple[Array, LinearisedModel] | None = None
        highest = (self.spectra.band[1] + SIDEBANDS * pumping.frequency) / self.spectra.resolution
        bins = np.arange(1, min(int(highest), len(self.spectra.output) - 1) + 1)
        if pumping.active:
            bins = bins[bins % self.spectra.window.periods != 0]
        self.bins = bins
        self.variance = np.full(len(bins), float(np.mean(np.abs(self.spectra.output[bins]) ** 2)))
        self.cycle_variance = self._disturbance()

    def _disturbance(self) -> Array:
        """Variance of each harmonic of the measured cycle (CYCLE + 1,): line noise of the neighbouring bins."""
        p = self.spectra.window.periods
        length = p * self.pumping.period
        found = np.full(CYCLE + 1, np.inf)
        for n in range(min(CYCLE + 1, len(self.spectra.cycle))):
            near = np.abs(np.arange(n * p - p // PARTS, n * p + p // PARTS + 1))
            near = near[(near % p != 0) & (near < len(self.spectra.output))]
            if len(near):
                found[n] = float(np.mean(np.abs(self.spectra.output[near]) ** 2)) / length**2
        return np.maximum(found, 1e-24)

    def thinned(self, lines: int) -> None:
        """Keep at most `lines` spectral lines, those with the largest response."""
        power = np.abs(self.spectra.output[self.bins]) ** 2
        strong = np.flatnonzero(power > 1e-4 * power.max())
        keep = np.sort(strong[:: max(1, -(-len(strong) // lines))])
        self.bins, self.variance = self.bins[keep], self.variance[keep]

    def linearised(self, values: Array) -> LinearisedModel:
        if self._last is not None and np.array_equal(values, self._last[0]):  # only the delays differ
            return self._last[1]
        model = self.model.with_values(dict(zip(self.names, values)))
        order = ORDER if self.pumping.active else 0  # without pumping there are no sidebands
        found = linearised(model, self.pumping, self._guess, order, self.kind)
        self._guess = found.cycle.states[0]
        self._last = np.array(values), found
        return found

    def sidebands(self, model: LinearisedModel) -> Complex:
        """G_m U at the bins without delays, (h, n)."""
        frequency: Array = self.bins.astype(np.float64) * self.spectra.resolution
        return model.htf(self.m, frequency) * self.spectra.shifted_input(self.m, self.bins)

    def expected(self, parts: Complex, input_delay: float, measurement_delay: float) -> Complex:
        omega = 2 * np.pi * self.spectra.resolution * self.bins
        turned = np.exp(1j * self.pumping.omega * self.m * input_delay) @ parts
        return turned * np.exp(-1j * omega * (input_delay + measurement_delay))

    def residual(self, values: Array) -> Array:
        """Deviations divided by their standard deviations: real parts, then imaginary parts."""
        *own, input_delay, measurement_delay = values
        try:
            model = self.linearised(np.array(own))
        except InputError:
            return np.full(2 * len(self.bins) + (2 * CYCLE + 1 if self.cycle else 0), 1e6)
        measured = self.spectra.output[self.bins]
        left = (self.expected(self.sidebands(model), input_delay, measurement_delay) - measured) / np.sqrt(
            self.variance
        )
        parts = [np.sqrt(2.0) * left.real, np.sqrt(2.0) * left.imag]
        if self.cycle:
            n = np.arange(CYCLE + 1)
            shown = model.cycle.harmonics(CYCLE) * np.exp(-1j * self.pumping.omega * n * measurement_delay)
            gap: Complex = np.zeros(CYCLE + 1, dtype=np.complex128)
            seen = min(CYCLE + 1, len(self.spectra.cycle))
            gap[:seen] = (shown[:seen] - self.spectra.cycle[:seen]) / np.sqrt(self.cycle_variance[:seen])
            parts += [np.real(gap)[:1], np.sqrt(2.0) * np.real(gap)[1:], np.sqrt(2.0) * np.imag(gap)[1:]]
        return np.concatenate(parts)

    def best_delays(self, model: LinearisedModel) -> tuple[float, float, float]:
        """Smallest unexplained share of the power over a grid of delays, and the delays that give it.

        The sum of the delays shifts the phase of the response with ω; the input delay shifts the phase of the
        sidebands. All pairs of the grid are one matrix product. Where the limit cycle's phase is known, it limits
        the measurement delay.
        """
        parts = self.sidebands(model)
        measured = self.spectra.output[self.bins]
        omega = 2 * np.pi * self.spectra.resolution * self.bins
        step = min(0.01, 0.25 / (self.spectra.band[1] + 1e-9) / 2)
        one = np.arange(0.0, LONGEST_DELAY + 0.5 * step, step)
        total = np.arange(0.0, 2.0 * LONGEST_DELAY + 0.5 * step, step)
        turned = np.exp(1j * self.pumping.omega * np.multiply.outer(one, self.m)) @ parts
        cross = ((turned * measured.conj()) @ np.exp(-1j * np.multiply.outer(omega, total))).real
        left = (
            float(np.sum(np.abs(measured) ** 2)) + np.sum(np.abs(turned) ** 2, axis=1)[:, None] - 2.0 * cross
        )
        left = left / float(np.sum(np.abs(measured) ** 2))
        later = total[None, :] - one[:, None]
        possible = (later > -step) & (later < LONGEST_DELAY + step)
        if self.cycle:
            period = self.pumping.period
            shown = np.angle(self.spectra.cycle[1] / model.cycle.harmonics(1)[1])
            phase = -shown / self.pumping.omega
            away = np.abs((later - phase + 0.5 * period) % period - 0.5 * period)
            left = left + 0.1 * (away / (0.1 * period)) ** 2
        left = np.where(possible, left, np.inf)
        i, j = np.unravel_index(int(np.argmin(left)), left.shape)
        return float(left[i, j]), float(one[i]), float(max(later[i, j], 0.0))

    def reach(self, values: Array) -> tuple[float, Array]:
        """Unexplained share at these parameters under the best delays, and those delays."""
        try:
            model = self.linearised(values)
        except InputError:
            self._guess = None
            return math.inf, np.zeros(2)
        left, *delays = self.best_delays(model)
        if self.cycle:
            size = np.abs(self.spectra.cycle[1])
            left += 0.3 * float((np.abs(model.cycle.harmonics(1)[1]) / size - 1.0) ** 2)
        return left, np.array(delays)


def _scan(comparison: _Comparison, start: Array) -> tuple[Array, Array, float]:
    """Best point of a multiplicative grid over the parameters, one after the other, in two passes, with the best
    delays."""
    values = start.copy()
    best, delays = comparison.reach(values)
    for _ in range(2):
        before = best
        for i in range(len(values)):
            centre = values[i]
            if best < UNEXPLAINED_NEAR_OPTIMUM:
                return values, delays, best
            for factor in FACTORS if centre != 0.0 else ():
                trial = values.copy()
                trial[i] = np.clip(centre * factor, *comparison.model.parameters[comparison.names[i]].bounds)
                left, found = comparison.reach(trial)
                if left < best - 1e-9:
                    best, values, delays = left, trial, found
                elif left == before:
                    break  # the data are not sensitive to this parameter
        if best > 0.98 * before:
            break
    return values, delays, best


def _descend(comparison: _Comparison, start: Array, tolerance: float = 1e-8) -> Array:
    bounds = [comparison.model.parameters[name].bounds for name in comparison.names]
    low = np.array([b[0] for b in bounds] + [-0.05, -0.05])
    high = np.array([b[1] for b in bounds] + [LONGEST_DELAY + 0.1, LONGEST_DELAY + 0.1])
    units = [comparison.model.parameters[name].unit for name in comparison.names]
    own = [abs(v) or (TIME if unit == "s" else 1.0) for v, unit in zip(start, units)]
    scale = np.array([*own, TIME, TIME])
    inside = np.clip(start, low, high)
    found = least_squares(
        comparison.residual,
        inside,
        bounds=(low, high),
        x_scale=scale,
        diff_step=1e-5,
        xtol=tolerance,
        ftol=tolerance,
        max_nfev=25,
    )
    return found.x


@threadpool_limits.wrap(limits=1)  # many small matrices: threads would wait for each other
def harmonic_likelihood(
    record: Record, model: Model, pumping: Pumping, cycle: bool = True, search: bool = False
) -> HarmonicFit:
    """Estimate the model's free parameters and both delays from one record, also from starting values that are far off.

    `model` has no forcing of its own: `pumping` describes it. With `cycle` False the limit cycle is not used as
    data. With `search` True only a start for another fit is computed, from few spectral lines in one pass. Raises
    InputError when the record has no input or the model no limit cycle.
    """
    if record.input is None:
        raise InputError(f"{record.name}: has no input, so there is no transfer function to fit")
    plain = model.with_values({name: 0.0 for name in DELAYS if name in model.parameters})
    ring_down = 2.0
    comparison = _Comparison(record, plain, pumping, cycle, ring_down)
    if search:
        comparison.thinned(LINES)
    # while the search is far off, the limit cycle must not outweigh the response; its small harmonics have no weight yet
    exact, response = comparison.cycle_variance, comparison.variance
    size = float(np.abs(comparison.spectra.cycle[1])) if len(comparison.spectra.cycle) > 1 else 1.0
    comparison.cycle_variance = np.full(CYCLE + 1, (0.03 * size) ** 2 + 1e-30)
    comparison.variance = np.full(len(response), 3e-4 * float(np.sum(response)))
    start = np.array([plain.value(name) for name in comparison.names])
    own, delays, _ = _scan(comparison, start)
    values = _descend(comparison, np.concatenate([own, delays]), 1e-4 if search else 1e-8)
    for _ in range(0 if search else 2):
        comparison.cycle_variance = exact
        left = np.abs(_left(comparison, values)) ** 2
        wide = max(9, len(left) // 60)
        local = np.convolve(left, np.ones(wide) / wide, mode="same")
        comparison.variance = np.maximum(local, 1e-16 * float(np.mean(response)))
        values = _descend(comparison, values)
    left = _left(comparison, values)
    measured = comparison.spectra.output[comparison.bins]
    names = (*comparison.names, *DELAYS)
    return HarmonicFit(
        model.with_values({n: v for n, v in zip(names, values) if n in model.parameters}),
        names,
        values,
        _covariance(comparison, values),
        float(np.sqrt(np.sum(np.abs(left) ** 2) / np.sum(np.abs(measured) ** 2))),
        comparison.bins,
        measured + left,
    )


def _left(comparison: _Comparison, values: Array) -> Complex:
    """Predicted minus measured response at the bins."""
    parts = comparison.sidebands(comparison.linearised(values[:-2]))
    return comparison.expected(parts, values[-2], values[-1]) - comparison.spectra.output[comparison.bins]


def _covariance(comparison: _Comparison, values: Array) -> Array:
    """Inverse of the Fisher information F = 2 Re Σ_l (∂Ŷ_l)ᴴ (∂Ŷ_l) / σ_l² + limit cycle."""
    base = comparison.residual(values)
    columns = []
    for i, value in enumerate(values):
        step = 1e-5 * (abs(value) or 1.0) if i < len(values) - 2 else 1e-6
        moved = values.copy()
        moved[i] += step
        columns.append((comparison.residual(moved) - base) / step)
    jacobian = np.column_stack(columns)
    norms = np.linalg.norm(jacobian, axis=0)
    norms[norms == 0.0] = 1e-150
    scaled = jacobian / norms
    return np.linalg.pinv(scaled.T @ scaled, rcond=1e-13, hermitian=True) / np.outer(norms, norms)


def visible_sidebands(
    record: Record,
    model: Model,
    pumping: Pumping,
    noise_density: float,
    harmonics: Sequence[int] = (1, 2, 3, 4),
) -> list[int]:
    """Harmonics |m| that exceed noise of `noise_density` [unit²/Hz], two-sided: Σ|G_m U|²/σ² > 25."""
    found = spectra(record, pumping, 2.0, max(harmonics) + 1)
    bins = np.arange(1, len(found.output))
    m = np.array([sign * h for h in harmonics for sign in (-1, 1)])
    frequency: Array = bins.astype(np.float64) * found.resolution
    parts = linearised(model, pumping, excited=record.input_kind).htf(m, frequency)
    power = np.sum(np.abs(parts * found.shifted_input(m, bins)) ** 2, axis=1)
    floor = noise_density * found.window.periods * pumping.period
    return [h for h in harmonics if power[np.abs(m) == h].sum() > 25.0 * floor]
