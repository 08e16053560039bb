"""Delays by the paper's method from all records together, and the assumption on which their separation rests."""

import math
from collections.abc import Sequence

import numpy as np

from rhythmid.errors import InputError
from rhythmid.identify.delay_fit import DelayEstimate
from rhythmid.identify.identification import Delays, Estimate
from rhythmid.identify.paper import PaperResult

ON_ROBOT = "the forcing acts on the machine without delay"
ASSUMPTIONS = {
    "forcing channel": f"{ON_ROBOT}, and the recorded forcing has the phase that acts, on the clock of the measurements",
    "stated formula": f"{ON_ROBOT}, with the phase stated for it in the record's time",
    "model": f"{ON_ROBOT}, with the phase that the model's periodic_forcing has in the record's time; it was not recorded",
}
NO_PHASE = (
    "the excitation reaches too few frequencies to read a delay from phases; excite more of them, or a chirp"
)
NO_SIDEBANDS = (
    "the excitation reaches the sidebands at too few frequencies to tell the two delays apart by their phases"
)
NO_FORCING = "no forcing is known, and with it no phase of the machine's cycle"


def combined(estimates: Sequence[tuple[float, float]]) -> tuple[float, float]:
    """Inverse-variance weighted mean of independent (value, std)."""
    if len(estimates) == 1:
        return estimates[0]
    values = np.array([value for value, _ in estimates])
    weight = np.array([1.0 / max(std, 1e-300) ** 2 if math.isfinite(std) else 0.0 for _, std in estimates])
    if weight.sum() == 0.0:
        return float(values.mean()), math.inf
    return float(weight @ values / weight.sum()), float(1.0 / math.sqrt(weight.sum()))


def _cycle_delay(result: PaperResult) -> float:
    """Measurement delay [s], modulo the period, by which the limit cycle's fundamental lags behind the model's."""
    model = result.fit.linearised.cycle.harmonics(1)[1]
    return float(-np.angle(result.spectra.cycle[1] / model) / result.pumping.omega)


def _closure(result: PaperResult, combined: DelayEstimate) -> float | None:
    """(A + C − B) / std with A the limit cycle's phase, C the sidebands' offset, B the slope of G_0."""
    whole, sided = result.delays.get(0), [d for m, d in result.delays.items() if m != 0]
    if whole is None or not sided or combined.input is None or combined.measurement is None:
        return None
    best = min(sided, key=lambda d: d.input_std or math.inf)
    assert best.input is not None and best.input_std is not None
    period = result.pumping.period
    gap = _cycle_delay(result) + best.input - whole.sum
    gap = (gap + 0.5 * period) % period - 0.5 * period
    return gap / math.hypot(best.input_std, whole.sum_std)


def paper_delays(results: Sequence[PaperResult], source: str) -> Delays:
    def estimate(pairs: Sequence[tuple[float, float]]) -> Estimate:
        return Estimate(*combined(pairs), "s")

    nothing = Estimate(None, None, "s")
    found = [result.combined for result in results]
    if source == "none" or any(one is None for one in found):
        whole = [result.delays[0] for result in results if 0 in result.delays]
        if not whole:
            raise InputError(NO_PHASE)
        total = estimate([(one.sum, one.sum_std) for one in whole])
        return Delays(nothing, nothing, total, False, NO_FORCING if source == "none" else NO_SIDEBANDS)
    pairs = [one for one in found if one is not None]
    return Delays(
        estimate([(one.input or 0.0, one.input_std or 0.0) for one in pairs]),
        estimate([(one.measurement or 0.0, one.measurement_std or 0.0) for one in pairs]),
        estimate([(one.sum, one.sum_std) for one in pairs]),
        True,
        ASSUMPTIONS.get(source, ON_ROBOT),
        _closure(results[0], pairs[0]),
        pairs[0].aliases,
    )
