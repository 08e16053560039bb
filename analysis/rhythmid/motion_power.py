"""Power of a motion: what the errors of a part of a record are a share of."""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def motion_power(value: Array, chosen: NDArray[np.bool_]) -> float:
    """Sum of squares of the motion `value` (n,) about its mean over the chosen samples, at least what so many samples of the whole have.

    A part in which a machine has come to rest holds hardly any motion of its own: as a share of that, one step of an encoder would be
    an error of any size. Errors there are a share of the motion that led to the rest.
    """
    square = (value - value.mean()) ** 2
    return max(float(np.sum(square[chosen])), float(np.sum(chosen)) * float(np.mean(square)))
