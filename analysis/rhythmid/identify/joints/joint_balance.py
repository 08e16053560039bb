"""The balance of a joint whose motion is in many short stretches, such as flights between contacts."""

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from rhythmid.identify.inverse_dynamics.balance import Balance
from rhythmid.identify.inverse_dynamics.motion import low_pass

Array = NDArray[np.float64]
SHORT = 400  # largest number of samples in a stretch for which its filter is a matrix


class JointBalance(Balance):
    """A balance of many short stretches: the filter for each length is a matrix that is computed once."""

    def filtered(self, signal: Array, period: float) -> Array:
        if len(signal) > SHORT:
            return super().filtered(signal, period)
        return _filter(len(signal), period, self.bandwidth.effort) @ signal


@lru_cache(maxsize=512)
def _filter(length: int, period: float, frequency: float) -> Array:
    """The zero-phase low-pass as a matrix (length, length)."""
    return np.ascontiguousarray(low_pass(np.eye(length), period, frequency))
