"""Harmonic transfer functions without a model: selects the method for the excitation and the number of harmonics."""

from typing import Literal

import numpy as np
from numpy.typing import NDArray

from rhythmid.errors import InputError
from rhythmid.ltp.excited_lines import ExcitedLines, excited_lines
from rhythmid.ltp.harmonic_estimate import HarmonicEstimate, HarmonicEstimates
from rhythmid.ltp.local_rational import LEAKAGE, highest_local, local_rational, oversampling
from rhythmid.ltp.number_of_harmonics import TOO_LARGE, chosen, significance
from rhythmid.ltp.regularised_least_squares import HtfEstimate, estimate_htf, regularised_least_squares
from rhythmid.ltp.separated_lines import highest_separated, read_off
from rhythmid.ltp.spectra import Spectra

Array = NDArray[np.float64]
HtfMethod = Literal["auto", "separated_lines", "local_rational", "regularised_least_squares"]
SMOOTHED = 3  # M of equation (5)


def harmonic_transfer_functions(
    spectra: Spectra,
    ring_down: float,
    method: HtfMethod = "auto",
    harmonics: int | None = None,
    false_alarm: float = TOO_LARGE,
) -> HarmonicEstimates:
    """Transfer functions −M … M of the machine from the `spectra` of a record.

    Parameters
    ----------
    ring_down : time constant [s] of the machine's slowest motion, approximately; it gives the width of a resonance.
    method : `separated_lines` needs a periodic excitation whose harmonics fall into separate bins; `local_rational`
        a dense one; `regularised_least_squares` is the paper's equation (5), which smooths. `auto` takes the first
        of them that the excitation allows.
    harmonics : M; None chooses the largest significant one, with probability `false_alarm` of too many.

    Raises InputError when the record has no excitation, or does not allow the `method` or so many `harmonics`.
    """
    if method != "regularised_least_squares":
        lines = excited_lines(spectra)
        found = None
        if method in ("auto", "separated_lines"):
            found = _separated(lines, harmonics, false_alarm)
        if found is None and method in ("auto", "local_rational"):
            found = _local(lines, ring_down, harmonics, false_alarm)
        if found is not None:
            return found
        if method != "auto":
            raise InputError(f"the excitation does not allow {method.replace('_', ' ')}: {_needed(method)}")
    highest = SMOOTHED if harmonics is None else harmonics
    operator = regularised_least_squares(
        spectra, highest if spectra.pumping.active else 0, ring_down=ring_down
    )
    return smoothed(estimate_htf(operator))


def _needed(method: HtfMethod) -> str:
    if method == "separated_lines":
        return (
            "it needs shifted chirps or interleaved lines that repeat over whole periods, and bins left empty"
        )
    return "it needs lines closer together than the machine's resonance is wide"


def _separated(lines: ExcitedLines, harmonics: int | None, false_alarm: float) -> HarmonicEstimates | None:
    if lines.spectra.window.leakage > LEAKAGE:
        return None
    highest = highest_separated(lines)
    if highest is None or (harmonics is not None and harmonics > highest):
        return None
    if harmonics is not None:
        return HarmonicEstimates("separated_lines", read_off(lines, harmonics))
    tests = significance(read_off(lines, highest), 1, false_alarm)
    return HarmonicEstimates("separated_lines", read_off(lines, chosen(tests)), tests, false_alarm)


def _local(
    lines: ExcitedLines, ring_down: float, harmonics: int | None, false_alarm: float
) -> HarmonicEstimates | None:
    highest = highest_local(lines, ring_down)
    if highest is None or (harmonics is not None and harmonics > highest):
        return None
    functions = local_rational(lines, highest if harmonics is None else harmonics)
    if not any(len(one.value) for one in functions):
        return None
    if harmonics is not None:
        return HarmonicEstimates("local_rational", functions)
    tests = significance(functions, oversampling(lines, highest), false_alarm)
    m = chosen(tests)
    if m < highest:
        functions = local_rational(lines, m)
    return HarmonicEstimates("local_rational", functions, tests, false_alarm)


def smoothed(estimate: HtfEstimate) -> HarmonicEstimates:
    """Estimates by equation (5) where the excitation reaches. Their bands contain noise and smoothing bias; the
    residual does not separate one kind of error from another."""
    found = []
    assert estimate.htf.std is not None
    whole = np.hypot(estimate.htf.std, estimate.bias)
    for row, m in enumerate(estimate.htf.harmonics):
        at = estimate.reached[row]
        count = int(at.sum())
        std = whole[row, at]
        used = np.any(estimate.operator.shifted != 0.0, axis=0).sum()
        freedom = np.full(count, max(2.0, float(used) / 2.0 - estimate.operator.noise_gain[1] / 2.0))
        unknown: Array = np.full(count, np.nan)
        found.append(
            HarmonicEstimate(
                int(m), estimate.htf.frequency[at], estimate.htf.value[row, at], std, freedom, unknown, unknown, unknown,
                unknown,
            )
        )  # fmt: skip
    return HarmonicEstimates("regularised_least_squares", tuple(found))
