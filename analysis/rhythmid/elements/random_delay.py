"""Random delays as a function of stamp and seed alone: a run is reproducible, whole or in chunks."""

import math

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def _mixed(bits: NDArray[np.uint64]) -> NDArray[np.uint64]:
    """The finaliser of splitmix64 (G. L. Steele, D. Lea, C. H. Flood, OOPSLA 2014), which mixes all 64 bits."""
    bits = (bits ^ (bits >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    bits = (bits ^ (bits >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    return bits ^ (bits >> np.uint64(31))


def uniform_delay(stamps: Array, std: float, seed: float) -> Array:
    """Delays [s], uniform on [0, sqrt(12) std], for stamps [s] with a resolution of a nanosecond; (n,) -> (n,)."""
    nanoseconds = np.round(np.asarray(stamps) * 1e9).astype(np.int64).view(np.uint64)
    key = _mixed(np.array([int(seed)], dtype=np.int64).view(np.uint64) + np.uint64(0x9E3779B97F4A7C15))
    draw = _mixed(_mixed(nanoseconds) ^ key) >> np.uint64(11)
    return math.sqrt(12.0) * std * draw.astype(float) * 2.0**-53
