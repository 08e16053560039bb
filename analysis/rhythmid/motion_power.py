"""Power of a motion, the reference of relative errors of a part of a record."""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def motion_power(value: Array, chosen: NDArray[np.bool_]) -> float:
    """Sum of squares of the motion `value` (n,) about its mean over the chosen samples, at least what so many samples of the whole have.

    A part in which the machine has come to rest contains hardly any motion, so that one encoder step would be a very large relative
    error. Errors there are relative to the motion before the rest.
    """
    square = (value - value.mean()) ** 2
    return max(float(np.sum(square[chosen])), float(np.sum(chosen)) * float(np.mean(square)))
