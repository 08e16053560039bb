"""How good a search is: what a fit leaves of the motion and of the response to the command, beside the noise."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rhythmid.identify.output_error import Fit
from rhythmid.identify.series import Series
from rhythmid.ltp.pumping import Pumping

Array = NDArray[np.float64]
STUCK = 0.5  # unexplained share (rms) of the response to the command above which a fit is rejected
# unexplained share (rms) of the whole motion above which the model counts as not identified
POOR_MOTION = 0.2
CYCLE_HARMONICS = 24  # number that is projected out where the limit cycle is not used
NOISE_ALONE = 2.0  # ratio of residual to noise floor up to which a fit leaves the noise alone


@dataclass(frozen=True)
class Search:
    """Quality of a fit: unexplained shares (rms) of the whole motion and of the response to the command, and the
    ratio of residual to noise floor. `arrived` is False where the search is stuck or the model does not fit."""

    motion: float
    response: float
    over_noise: float

    @property
    def arrived(self) -> bool:
        return self.motion < POOR_MOTION and (self.response < STUCK or self.over_noise < NOISE_ALONE)

    def __str__(self) -> str:
        return (
            f"the fit leaves {self.motion:.1%} of the motion and {self.response:.0%} of the response to the command "
            f"unexplained, {self.over_noise:.3g} times the noise floor"
        )


def cycle_columns(series: Series, pumping: Pumping) -> Array:
    """Mean and harmonics of the limit cycle at the blocks' centres, as columns."""
    highest = int(0.5 / (series.period * series.block * pumping.frequency)) - 1
    n = np.arange(1, max(1, min(CYCLE_HARMONICS, highest)) + 1)
    angle = np.multiply.outer(pumping.omega * series.centres, n)
    return np.hstack([np.ones((len(angle), 1)), np.cos(angle), np.sin(angle)])


def explained(fit: Fit, pumping: Pumping | None) -> Search:
    """Compare the residuals of the fit with the motion, with the response to the command and with the noise."""
    left = response = floor = 0.0
    for one, residual in zip(fit.run.series, fit.residuals):
        used = one.used
        columns = np.ones((one.blocks, 1)) if pumping is None else cycle_columns(one, pumping)
        measured = one.averaged
        if one.ignored is not None:
            residual = residual - columns @ np.linalg.lstsq(columns[used], residual[used], rcond=1e-12)[0]
        moved = measured - columns @ np.linalg.lstsq(columns[used], measured[used], rcond=1e-12)[0]
        left += float(np.sum(residual[used] ** 2))
        response += float(np.sum(moved[used] ** 2))
        power = np.abs(np.fft.rfft(moved * np.hanning(len(moved)))) ** 2
        high = power[int(0.6 * len(power)) :]
        floor += float(np.mean(high)) * 2.0 * len(high) / 0.4 / 0.375 / len(moved)
    explained = max(response - floor, 1e-300)
    motion = fit.nrmse() if all(one.ignored is None for one in fit.run.series) else 0.0
    least = max(floor, 1e-18 * response, 1e-300)
    unexplained = float(np.sqrt(left / max(explained, 0.01 * response)))
    if pumping is not None and not any(one.commanded for one in fit.run.series):
        unexplained = 0.0  # no response to a command, only the limit cycle
    return Search(motion, unexplained, float(np.sqrt(left / least)))
