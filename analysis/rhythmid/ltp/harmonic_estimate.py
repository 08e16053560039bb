"""Result of an estimator of harmonic transfer functions: each function with its error levels."""

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from scipy.stats import f as f_distribution

from rhythmid.errors import InputError

if TYPE_CHECKING:
    import xarray as xr

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]


@dataclass(frozen=True, eq=False)
class HarmonicEstimate:
    """One harmonic transfer function, estimated without a model.

    All arrays have shape (n,). Levels are standard deviations of the complex value, √E|ΔH|², in its own unit; NaN
    where the excitation does not separate a level from the others.

    Attributes
    ----------
    m : index of the harmonic.
    frequency : output frequencies [Hz].
    value : complex128 H_m(jω) [output unit / input unit], delays included, in cycle time (see `Pumping`).
    std : standard deviation of the value from all error sources below.
    freedom : degrees of freedom of `std`.
    noise : level of noise.
    even, odd : levels of distortion of even and of odd order, as far as it acts like noise.
    aliasing : possible level of harmonics beyond those estimated.
    """

    m: int
    frequency: Array
    value: Complex
    std: Array
    freedom: Array
    noise: Array
    even: Array
    odd: Array
    aliasing: Array

    @property
    def radius(self) -> Array:
        """Radius of the disk about the value that contains the true value with 95 %: |ΔH|² ≤ std² F.95(2, 2 freedom)."""
        return self.std * np.sqrt(f_distribution.ppf(0.95, 2.0, 2.0 * self.freedom))


@dataclass(frozen=True)
class Significance:
    """Whether harmonics ±m exceed the noise: `p_value`, and whether it is below the `threshold` of the test."""

    m: int
    p_value: float
    threshold: float

    @property
    def visible(self) -> bool:
        return self.p_value < self.threshold


@dataclass(frozen=True, eq=False)
class HarmonicEstimates:
    """Transfer functions −M … M by one `method`. `tested` holds the tests that selected M, with probability
    `false_alarm` of an M that is too large; empty where M was given."""

    method: str
    functions: tuple[HarmonicEstimate, ...]
    tested: tuple[Significance, ...] = ()
    false_alarm: float = 0.0

    @property
    def harmonics(self) -> tuple[int, ...]:
        """The indices m."""
        return tuple(one.m for one in self.functions)

    def of(self, m: int) -> HarmonicEstimate:
        """The function of harmonic m. Raises InputError when it is not there."""
        for one in self.functions:
            if one.m == m:
                return one
        raise InputError(f"harmonic {m} is not among {', '.join(map(str, self.harmonics))}")

    def to_xarray(self, unit: str = "") -> "xr.Dataset":
        """The functions as an xarray Dataset over `harmonic` and `frequency` [Hz].

        Its variables are `value` (complex), `std`, `radius` (of the disk that contains the true value with 95 %)
        and `noise`; `unit` is stored as their unit. Raises InputError where xarray is not installed.
        """
        from rhythmid.ltp.dataset import dataset

        columns = {
            name: ([getattr(one, name) for one in self.functions], unit)
            for name in ("value", "std", "radius", "noise")
        }
        return dataset(self.harmonics, [one.frequency for one in self.functions], columns)
