"""Lines in a residual: noise has a smooth spectrum, a machine's own or foreign periodic motion does not.

R. A. Fisher, Proc. Roy. Soc. A 125 (1929) 54, with the spectrum's local level in place of its mean, so that coloured noise
does not pass for a line.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rhythmid.identify.noise import runs
from rhythmid.identify.output_error import Fit

Array = NDArray[np.float64]
NEIGHBOURS = 40  # bins on either side that give the local level
LEAKAGE = 3  # bins on either side that belong to a line


@dataclass(frozen=True)
class Line:
    """The strongest line of a fit's residuals: frequency [Hz], share of the residual's power, p-value by chance."""

    frequency: float
    share: float
    p_value: float


def strongest_line(fit: Fit) -> Line | None:
    """The strongest line in the residuals of all series; None where all are too short to tell."""
    best: Line | None = None
    count = 0
    for one, residual in zip(fit.run.series, fit.residuals):
        for stretch in runs(one.used):
            part = residual[stretch]
            if len(part) < 4 * NEIGHBOURS:
                continue
            power = np.abs(np.fft.rfft((part - part.mean()) * np.hanning(len(part)))) ** 2
            power = power[2:]
            count += len(power)
            level = _local_level(power)
            place = int(np.argmax(power / level))
            height = float(power[place] / level[place])
            near = power[max(0, place - LEAKAGE) : place + LEAKAGE + 1]
            share = float(max(near.sum() - level[place] * len(near), 0.0) / power.sum())
            line = Line(
                (place + 2) / (len(part) * one.period * one.block), share, math.exp(-min(height, 700.0))
            )
            if best is None or line.p_value < best.p_value:
                best = line
    if best is None:
        return None
    return Line(best.frequency, best.share, min(1.0, best.p_value * count))


def _local_level(power: Array) -> Array:
    """Mean power of the neighbourhood by its median (of exponentially distributed bins), the nearest bins left out."""
    width = 2 * NEIGHBOURS + 1
    padded = np.pad(power, NEIGHBOURS, mode="reflect")
    windows = np.lib.stride_tricks.sliding_window_view(padded, width)
    return np.maximum(np.median(windows, axis=1) / math.log(2.0), 1e-300)
