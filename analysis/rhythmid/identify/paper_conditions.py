"""Conditions for harmonic transfer functions and for the paper's method, and which of them a record does not meet."""

import numpy as np

from rhythmid.identify.paper import PaperResult
from rhythmid.ltp.pumping import Pumping

# largest difference between the commands before and at the end of the window, as a share of the command
LEAKAGE = 0.05
# largest response to the command relative to the limit cycle's motion (rms): with a quadratic law the response is
# distorted by as much
SMALL_RESPONSE_SHARE = 0.1
# share of the equations' degrees of freedom that the estimate may use; a fifth is left to estimate its error
FREEDOM = 0.8
NO_FORCING = "no periodic forcing is known: harmonic transfer functions are those of a machine that a forcing keeps on a limit cycle"


def lacks_transfer_functions(pumping: Pumping, result: PaperResult | str) -> str | None:
    """Missing condition for harmonic transfer functions; None where all hold. `result` is the reason where there
    are none."""
    if not pumping.active:
        return NO_FORCING
    if isinstance(result, str):
        return result
    share = response_share(result)
    if share > SMALL_RESPONSE_SHARE:
        return (
            f"the excitation is not small: the response to it is {share:.0%} of the limit cycle's motion, and linearisation allows "
            f"{SMALL_RESPONSE_SHARE:.0%}; reduce the amplitude"
        )
    return None


def lacks_paper_method(pumping: Pumping, result: PaperResult | str) -> str | None:
    """Missing condition for the paper's method; None where all hold."""
    missing = lacks_transfer_functions(pumping, result)
    if missing is not None or isinstance(result, str):
        return missing
    window, operator = result.spectra.window, result.estimate.operator
    if window.leakage > LEAKAGE:
        return (
            f"the command does not repeat over whole pumping periods ({window.leakage:.0%} of it differs): begin with a warm-up "
            "repetition, or leave silence at both ends"
        )
    used = int(np.any(operator.shifted != 0.0, axis=0).sum())
    taken = operator.noise_gain[1] / used
    if taken > FREEDOM:
        return (
            f"too few repetitions: the estimate takes {taken:.0%} of the degrees of freedom that {window.periods} pumping periods give, which "
            "leaves too few to estimate its errors from; record longer"
        )
    return None


def response_share(result: PaperResult) -> float:
    """Size (rms) of the response to the command as a share of the limit cycle's motion about its mean."""
    spectra = result.spectra
    bins = np.arange(1, len(spectra.output))
    beside = bins[bins % spectra.window.periods != 0]
    length = spectra.window.periods * spectra.pumping.period
    response = float(np.sum(np.abs(spectra.output[beside]) ** 2)) / length**2
    cycle = float(np.sum(np.abs(spectra.cycle[1:]) ** 2))
    return float(np.sqrt(response / cycle)) if cycle > 0.0 else np.inf
