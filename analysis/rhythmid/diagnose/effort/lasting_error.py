"""The part of an error of effort that lasts: what follows from errors that lie further back than the balance's filter mixes neighbours.

Noise that went through the filter follows from its own past for as long as the filter remembers, and no longer. What follows from
earlier errors is no noise: it is something that the model lacks, whatever that is.
"""

import math

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
PAST = 8  # errors that the next one is predicted from: two periods of the filter's cut-off, at 2.5 rows a period and more
FOLDS = 2  # halves of each record, of which each is predicted with what the other one says
ROWS = 4 * PAST  # of a record without which it says nothing


def lasting_share(error: Array, record: NDArray[np.int64], memory: int) -> float:
    """Share of the rms of an error that follows from errors `memory` rows and more before it; 0 where that predicts nothing.

    The prediction is linear, and made for each half of every record with coefficients of the other halves, so that chance predicts nothing.

    Parameters
    ----------
    error : (n,) predicted less recorded, at neighbouring rows.
    record : (n,) record of each row, in order.
    memory : rows over which the filter mixes neighbours.
    """
    past, now, fold = [], [], []
    for number in np.unique(record):
        one = error[record == number]
        if len(one) < ROWS + memory:
            continue
        windows = np.lib.stride_tricks.sliding_window_view(one[:-memory], PAST)
        later = one[PAST + memory - 1 :]
        past.append(windows)
        now.append(later)
        fold.append(np.arange(len(later)) * FOLDS // len(later))
    if not now:
        return 0.0
    x, y, of = np.vstack(past), np.concatenate(now), np.concatenate(fold)
    left = 0.0
    for number in range(FOLDS):
        out = of == number
        coefficients = np.linalg.lstsq(x[~out], y[~out], rcond=None)[0]
        left += float(np.sum((y[out] - x[out] @ coefficients) ** 2))
    whole = float(y @ y)
    return math.sqrt(max(1.0 - left / whole, 0.0)) if whole > 0.0 else 0.0
