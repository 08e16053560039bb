"""An observer: the recorded motion draws the simulated machine along, through a spring and a damper.

They are in proportion to the model's mass, so that the bandwidth stays as it is while that is estimated. Were they not, a
model without inertia and without forces would be drawn through every record, noise and all.
D. G. Luenberger, IEEE Trans. Autom. Control 16 (1971) 596. `force_scoring` says what it is for.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import PPoly

from rhythmid.elements.element import Element, Parameter
from rhythmid.model import Model
from rhythmid.simulation.compiled import Compiled
from rhythmid.simulation.signal import shifted

Array = NDArray[np.float64]


def _kernel(x, v, t, f, stiffness, damping, mass):
    return -mass * (stiffness * x + damping * v)


OBSERVER = Element(
    name="observer",
    slot="force",
    title="Observer",
    equation="F = −m (k x + d v), beside the recorded motion's m (k y + d ẏ)",
    parameters=(
        Parameter("stiffness", "1/s^2", "stiffness k for each unit of mass"),
        Parameter("damping", "1/s", "damping d for each unit of mass"),
    ),
    borrows={"mass": ("inertia.mass", None)},
    kernel=_kernel,
    acts="body",
    candidate=False,
    reference="D. G. Luenberger, IEEE Trans. Autom. Control 16 (1971) 596",
)


@dataclass(frozen=True)
class Observer:
    """A spring [1/s²] and a damper [1/s], both for each unit of mass, from the simulated machine to the recorded motion, whose
    `pull` [m/s²] is a function of the measurement's stamps [s]. By `size`, in the output's unit, the driving force (rms) would
    hold the simulation off."""

    stiffness: float
    damping: float
    pull: PPoly
    size: float

    def disturbance(self, mass: float, late: float, further: PPoly | None = None) -> PPoly:
        """Force [N] on a mass [kg] over physical time, the measurement being `late` [s] behind it, and a further one."""
        moved = shifted(self.pull, -late)
        moved = PPoly(mass * moved.c, moved.x, extrapolate=True)
        return moved if further is None else _sum(moved, further)


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
