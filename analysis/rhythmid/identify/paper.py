"""The paper's method, step by step: HTFs by (5), parameters from magnitudes (8), delays from phases (15)-(16)."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from threadpoolctl import threadpool_limits

from rhythmid.errors import InputError
from rhythmid.identify.delay_fit import DelayEstimate, combine_delays, fit_delays, shows_delays
from rhythmid.identify.magnitude_fit import MagnitudeFit, fit_magnitude
from rhythmid.ltp.htf import linearised
from rhythmid.ltp.pumping import Pumping
from rhythmid.ltp.regularised_least_squares import HtfEstimate, estimate_htf, regularised_least_squares
from rhythmid.ltp.spectra import Spectra, spectra
from rhythmid.model import Model
from rhythmid.record.record import Record

HARMONICS = 3  # M of section 2.2
TABLE = (0, -1, 1)  # harmonics of the paper's Table 1


@dataclass(frozen=True, eq=False)
class PaperResult:
    """Result of the paper's method for one record.

    Attributes
    ----------
    estimate : Ĥ_m by (5).
    fit : parameters by (8).
    delays : by (15)-(16) from each single harmonic that the excitation reaches.
    combined : by (9) from several harmonics together; None where only the sum is identifiable.
    loss : predicted relative loss of the peak of each |G_m| by the smoothing of (5), in the order of the harmonics.
    """

    pumping: Pumping
    spectra: Spectra
    estimate: HtfEstimate
    fit: MagnitudeFit
    delays: dict[int, DelayEstimate]
    combined: DelayEstimate | None
    loss: NDArray[np.float64]


@threadpool_limits.wrap(limits=1)  # many small matrices: threads would wait for each other
def paper_method(record: Record, model: Model, pumping: Pumping, harmonics: int = HARMONICS) -> PaperResult:
    """Identify `model` and its delays from a record by the paper's method.

    Raises InputError when the record has no input, a constant input or too few samples, or when the model has no
    limit cycle.
    """
    if record.input is None:
        raise InputError(
            f"{record.name}: has no input channel; identification needs the excitation (`rhythmid diagnose` takes records without)"
        )
    if np.ptp(record.input.value) == 0.0 and np.any(record.input.value):
        raise InputError(f"{record.name}: its input never changes; transfer functions need an excitation")
    ring_down = linearised(model, pumping).cycle.ring_down
    for _ in range(2):  # the smoothing depends on the ring-down, which is known after the first fit
        measured = spectra(record, pumping, ring_down, harmonics + 1)
        estimate = estimate_htf(regularised_least_squares(measured, harmonics, ring_down=ring_down))
        fit = fit_magnitude(estimate, model)
        before, ring_down = ring_down, fit.linearised.cycle.ring_down
        if 0.8 * before <= ring_down <= 1.25 * before:
            break
        model = fit.model
    delays: dict[int, DelayEstimate] = {}
    for m in TABLE if pumping.active else (0,):
        if abs(m) <= harmonics and shows_delays(estimate, m):
            delays[m] = fit_delays(estimate, fit.expected, m)
    sided = [m for m in delays if m != 0]
    combined = None
    if sided:
        best = max(sided, key=lambda m: np.abs(fit.expected[estimate.htf.row(m)]).max())
        start = (delays[best].input or 0.0, delays[best].measurement or 0.0)
        combined = combine_delays(estimate, fit.expected, list(delays), start)
    plain = np.abs(fit.linearised.htf(estimate.htf.harmonics, estimate.htf.frequency))
    at = np.argmax(np.where(estimate.reached, plain, 0.0), axis=1)
    rows = np.arange(len(plain))
    loss = 1.0 - np.abs(fit.expected[rows, at]) / plain[rows, at]
    return PaperResult(pumping, measured, estimate, fit, delays, combined, loss)
