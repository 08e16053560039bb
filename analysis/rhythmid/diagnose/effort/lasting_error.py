"""The lasting part of an effort error: the part predicted by errors further back than the balance's filter mixes neighbours.

Filtered noise is correlated over the length of the filter, and no further. An error that follows from earlier ones is not
noise: it shows that the model lacks something.
"""

import math

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
PAST = 8  # past errors that predict the next one: two periods of the filter's cut-off, at 2.5 rows a period and more
LEAST_ROWS = 4 * PAST  # minimum rows of a record


def lasting_share(error: Array, record: NDArray[np.int64], memory: int) -> float:
    """Share of an error's rms that is predicted by errors `memory` rows and more before it; 0 where nothing is.

    The prediction is linear. Each half of every record is predicted with the coefficients of the other halves, so that a
    chance correlation predicts nothing.

    Parameters
    ----------
    error : (n,) predicted less recorded, at neighbouring rows.
    record : (n,) record of each row, in order.
    memory : rows over which the filter mixes neighbours.
    """
    past, now, fold = [], [], []
    for number in np.unique(record):
        one = error[record == number]
        if len(one) < LEAST_ROWS + memory:
            continue
        windows = np.lib.stride_tricks.sliding_window_view(one[:-memory], PAST)
        later = one[PAST + memory - 1 :]
        past.append(windows)
        now.append(later)
        fold.append(2 * np.arange(len(later)) // len(later))
    if not now:
        return 0.0
    x, y, of = np.vstack(past), np.concatenate(now), np.concatenate(fold)
    left = 0.0
    for out in (of == 0, of == 1):
        coefficients = np.linalg.lstsq(x[~out], y[~out], rcond=None)[0]
        left += float(np.sum((y[out] - x[out] @ coefficients) ** 2))
    whole = float(y @ y)
    return math.sqrt(max(1.0 - left / whole, 0.0)) if whole > 0.0 else 0.0
