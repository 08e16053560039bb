"""What an estimator of harmonic transfer functions returns: each function with all that is known of its error."""

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
    """One harmonic transfer function, found without a model.

    All of shape (n,), the levels as standard deviations of the complex value, √E|ΔH|², in its own unit; NaN where the
    excitation cannot tell a level apart from the others.

    Attributes
    ----------
    m : index of the harmonic.
    frequency : output frequencies [Hz].
    value : complex128 H_m(jω) [output unit / input unit], delays included, in cycle time (see `Pumping`).
    std : of the value, from all that follows.
    freedom : degrees of freedom on which `std` rests.
    noise : what noise does.
    even, odd : what distortion of even and of odd order does, as far as it looks like noise.
    aliasing : what harmonics beyond those estimated may add.
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
        """Radius of the disk about the value that holds the truth with 95 %: |ΔH|² ≤ std² F.95(2, 2 freedom)."""
        return self.std * np.sqrt(f_distribution.ppf(0.95, 2.0, 2.0 * self.freedom))


@dataclass(frozen=True)
class Significance:
    """Whether harmonics ±m stand out of the noise: `p_value`, and whether it is below the `threshold` of the test."""

    m: int
    p_value: float
    threshold: float

    @property
    def visible(self) -> bool:
        return self.p_value < self.threshold


@dataclass(frozen=True, eq=False)
class HarmonicEstimates:
    """Transfer functions −M … M by one `method`; `tested` is how M was chosen, with its probability `false_alarm` of an M
    that is too large; empty where M was given."""

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

        Its variables are `value` (complex), `std`, `radius` (of the disk that holds the truth with 95 %) and `noise`; `unit` is
        written beside them. Raises InputError where xarray is not installed.
        """
        from rhythmid.ltp.dataset import dataset

        columns = {
            name: ([getattr(one, name) for one in self.functions], unit)
            for name in ("value", "std", "radius", "noise")
        }
        return dataset(self.harmonics, [one.frequency for one in self.functions], columns)
