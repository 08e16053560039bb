"""Harmonic transfer functions (HTFs): the response at other frequencies to an input at one, from a model or from data.

Convention of the paper's equation (4), used throughout: Y(jω) = Σ_m G_m(jω) U(j(ω − mω_p)), with ω the output's frequency.
A real system has G_−m(−jω) = conj G_m(jω).
"""

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from rhythmid.errors import InputError
from rhythmid.ltp.harmonic_state_space import HarmonicStateSpace, harmonic_state_space
from rhythmid.ltp.limit_cycle import LimitCycle, limit_cycle
from rhythmid.ltp.linearisation import linearise
from rhythmid.ltp.pumping import Pumping
from rhythmid.model import Model
from rhythmid.simulation.right_hand_side import InputKind
from rhythmid.simulation.transport import MEASUREMENT, delays

if TYPE_CHECKING:
    import xarray as xr

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]
# harmonics of the state kept on either side; more change the paper's G_0 and G_±1 by less than 5e-5
ORDER = 12


@dataclass(frozen=True, eq=False)
class HarmonicTransferFunctions:
    """HTFs at output frequencies.

    Attributes
    ----------
    harmonics : int[h] indices m.
    frequency : float64[n] output frequency ω/2π [Hz].
    value : complex128[h, n] G_m(jω) (or H_m) [output unit / input unit], in cycle time (see `Pumping`).
    std : float64[h, n] standard deviation of each complex value, or None where it is exact or unknown.
    """

    harmonics: NDArray[np.int64]
    frequency: Array
    value: Complex
    std: Array | None = None

    def row(self, m: int) -> int:
        """Row of harmonic m. Raises InputError when it is not there."""
        found = np.flatnonzero(self.harmonics == m)
        if len(found) == 0:
            raise InputError(f"harmonic {m} is not among {', '.join(map(str, self.harmonics))}")
        return int(found[0])

    def of(self, m: int) -> Complex:
        """G_m(jω), complex128[n]."""
        return self.value[self.row(m)]

    def delayed(
        self, input_delay: float, measurement_delay: float, frequency: float
    ) -> "HarmonicTransferFunctions":
        """H_m = G_m exp(−j[(ω − mω_p) τ_u + ω τ_y]): paper, equation (7); delays [s], pumping frequency [Hz]."""
        turn = delay_phase(self.harmonics, self.frequency, input_delay, measurement_delay, frequency)
        return replace(self, value=self.value * np.exp(-1j * turn))

    def to_xarray(self, unit: str = "") -> "xr.Dataset":
        """The functions as an xarray Dataset over `harmonic` and `frequency` [Hz]; `unit` is stored as their unit.

        Raises InputError where xarray is not installed.
        """
        from rhythmid.ltp.dataset import dataset

        columns = {"value": (list(self.value), unit)}
        if self.std is not None:
            columns["std"] = (list(self.std), unit)
        return dataset(self.harmonics.tolist(), [self.frequency] * len(self.harmonics), columns)


def delay_phase(
    harmonics: NDArray[np.int64],
    frequency: Array,
    input_delay: float,
    measurement_delay: float,
    pumping: float,
) -> Array:
    """(ω − mω_p) τ_u + ω τ_y [rad] of equation (9); harmonics (h,), frequency [Hz] (n,) -> (h, n)."""
    shifted = frequency[None, :] - np.asarray(harmonics)[:, None] * pumping
    return 2.0 * np.pi * (shifted * input_delay + frequency[None, :] * measurement_delay)


@dataclass(frozen=True, eq=False)
class LinearisedModel:
    """A model's limit cycle and its harmonic state space around it."""

    cycle: LimitCycle
    state_space: HarmonicStateSpace

    def htf(self, harmonics: NDArray[np.int64], frequency: Array) -> Complex:
        """G_m(jω) without the model's transport delays; (h,), [Hz] (n,) -> (h, n)."""
        return self.state_space.htf(harmonics, frequency)


def linearised(
    model: Model,
    pumping: Pumping,
    guess: Array | None = None,
    order: int = ORDER,
    excited: InputKind = "force",
    effort: float | None = None,
) -> LinearisedModel:
    """Limit cycle, equation (1) and equation (2) of a model. `guess` as for `limit_cycle`, `effort` as for `linearise`.

    Raises InputError when there is no limit cycle, and for an input that also acts by its rate (a moving base).
    """
    if excited == "base_displacement":
        raise InputError(
            "harmonic transfer functions need a force or a base acceleration as input, not a displacement"
        )
    cycle = limit_cycle(model, pumping, guess, excited)
    return LinearisedModel(cycle, harmonic_state_space(linearise(cycle, effort), order))


def transport_delays(model: Model, at: float = 0.0) -> tuple[float, float]:
    """Delays (τ_u, τ_y) [s] of the model's command and measurement paths, for timestamps near `at` [s]."""
    stamps = np.array([at])

    def total(*slots: str) -> float:
        return sum((float(late[0]) for _, late in delays(model, stamps, *slots)), 0.0)

    return total("command"), total(*MEASUREMENT)


def theoretical_htf(
    model: Model, pumping: Pumping, harmonics: NDArray[np.int64], frequency: Array, delays: bool = True
) -> HarmonicTransferFunctions:
    """HTFs of a model by equations (1)-(3), with its transport delays by (7) unless `delays` is False."""
    found = HarmonicTransferFunctions(
        np.asarray(harmonics), frequency, linearised(model, pumping).htf(harmonics, frequency)
    )
    return found.delayed(*transport_delays(model), pumping.frequency) if delays else found
