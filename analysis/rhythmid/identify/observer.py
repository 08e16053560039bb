"""Force scoring: the recorded motion draws the simulated machine along, through a spring and a damper.

D. G. Luenberger, IEEE Trans. Autom. Control 16 (1971) 596. Where a machine integrates, or sticks and slips, a free run adds
up every small disturbance until it means nothing. Tied to the record it cannot get far: what it stays behind by is the
force that the model lacks, seen through 1 / (m s² + d s + k). This is inverse dynamics without a derivative of the
measurement: force and simulation are compared below the observer's bandwidth, and all else goes on as in a free run.
A machine of which the velocity was measured is drawn by the damper alone; what it lags behind is the force over m s + d.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import PPoly

from rhythmid.compiled import Compiled
from rhythmid.elements.element import Element, Parameter
from rhythmid.model import Model
from rhythmid.signal import shifted, spline

if TYPE_CHECKING:
    from rhythmid.identify.series import Series

Array = NDArray[np.float64]
FINER = 4  # times as many averages a second in the motion that pulls as in those that are compared


def _kernel(x, v, t, f, stiffness, damping):
    return -stiffness * x - damping * v


OBSERVER = Element(
    name="observer",
    slot="force",
    title="Observer",
    equation="F = −k x − d v, beside the recorded motion's k y + d ẏ",
    parameters=(Parameter("stiffness", "N/m", "stiffness k"), Parameter("damping", "N*s/m", "damping d")),
    kernel=_kernel,
    acts="body",
    candidate=False,
    reference="D. G. Luenberger, IEEE Trans. Autom. Control 16 (1971) 596",
)


@dataclass(frozen=True)
class Observer:
    """A spring [N/m] and a damper [N s/m] from the simulated machine to the recorded motion, whose `pull` [N] is a function
    of the measurement's stamps [s]. By `size`, in the output's unit, the driving force (rms) would hold the simulation off."""

    stiffness: float
    damping: float
    pull: PPoly
    size: float

    def disturbance(self, late: float, further: PPoly | None = None) -> PPoly:
        """Force on the mass [N] over physical time, the measurement being `late` [s] behind it, and a further one."""
        moved = shifted(self.pull, -late)
        return moved if further is None else _sum(moved, further)


def observed(series: "Sequence[Series]", model: Model, frequency: float) -> "list[Series]":
    """The series, each tied to its record by an observer of this frequency [Hz]: critically damped where the position was
    measured, a damper alone where the velocity was."""
    omega = 2.0 * math.pi * frequency
    found = []
    for one in series:
        motion = _motion(one.time, one.value, max(1, one.block // FINER))
        if one.measured == "velocity":
            stiffness, damping = 0.0, model.mass.value * omega
            holds, pull = damping, PPoly(damping * motion.c, motion.x, extrapolate=True)
        else:
            stiffness, damping = model.mass.value * omega**2, 2.0 * model.mass.value * omega
            rate = motion.derivative()
            cubic = np.vstack([np.zeros((1, rate.c.shape[1])), rate.c])
            holds, pull = stiffness, PPoly(stiffness * motion.c + damping * cubic, motion.x, extrapolate=True)
        effort = sum(
            (part(one.centres) for part in (one.command, one.forcing) if part is not None),
            np.zeros(one.blocks),
        )
        size = float(np.std(effort)) / holds
        found.append(replace(one, observer=Observer(stiffness, damping, pull, size)))
    return found


def _motion(time: Array, value: Array, block: int) -> PPoly:
    """Spline through averages of the measurement, which a bent motion moves by a 24th of its second difference."""
    count = len(time) // block
    centres, averages = (a[: count * block].reshape(count, block).mean(axis=1) for a in (time, value))
    bend = np.zeros(count)
    bend[1:-1] = np.diff(averages, 2)
    return spline(centres, averages - (1.0 - 1.0 / block**2) / 24.0 * bend)


def with_observer(model: Model, observer: Observer | None) -> Model:
    """The model as it is simulated over a series with this observer."""
    if observer is None:
        return model
    return model.with_element(
        OBSERVER, {"stiffness": observer.stiffness, "damping": observer.damping}, fixed=True
    )


def tied(compiled: Compiled, observer: Observer | None) -> Compiled:
    """The structure of a model `with_observer`, for parameter vectors of the model without it."""
    if observer is None:
        return compiled
    known = {"observer.stiffness": observer.stiffness, "observer.damping": observer.damping}
    parameters = tuple((name, known.get(name, default)) for name, default in compiled.layout.parameters)
    return replace(compiled, layout=replace(compiled.layout, parameters=parameters))


def _sum(first: PPoly, second: PPoly) -> PPoly:
    """The sum of two piecewise polynomials, on the pieces of both."""
    knots = np.unique(np.concatenate([first.x, second.x]))
    return PPoly(_on(first, knots) + _on(second, knots), knots, extrapolate=True)


def _on(signal: PPoly, knots: Array) -> Array:
    """Coefficients (4, n − 1) of a signal of degree three at most on finer knots (n,)."""
    coefficients = np.zeros((4, len(knots) - 1))
    for order, scale in enumerate((1.0, 1.0, 0.5, 1.0 / 6.0)):
        part = signal if order == 0 else signal.derivative(order)
        coefficients[3 - order] = scale * part(knots[:-1])
    return coefficients
