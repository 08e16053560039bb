"""The base class of excitations: a pure function of the time since its start, with a known duration and peak."""

from abc import ABC, abstractmethod

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict

Array = NDArray[np.float64]


class Excitation(BaseModel, ABC):
    """A command u(t) [N]. Outside [0, duration) it is zero."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    @property
    @abstractmethod
    def duration(self) -> float:
        """Length [s], silences included."""

    @abstractmethod
    def shape(self, time: Array) -> Array:
        """Value [N] at times [s] within the duration; shapes (n,) -> (n,)."""

    @property
    def peak(self) -> float:
        """Largest |u| [N], by default found on a 1 ms grid."""
        return float(np.max(np.abs(self(np.arange(0.0, self.duration, 1e-3))), initial=0.0))

    def __call__(self, time: Array) -> Array:
        """Value [N] at any times [s] since the start; shapes (n,) -> (n,)."""
        time = np.asarray(time, dtype=float)
        inside = (time >= 0.0) & (time < self.duration)
        value = np.zeros(time.shape)
        if np.any(inside):
            value[inside] = self.shape(time[inside])
        return value
