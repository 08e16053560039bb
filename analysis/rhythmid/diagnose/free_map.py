"""Free maps: an unknown smooth law of one quantity, as an element that the simulator runs.

F(z) = Σ c_i B_i((z − low) / (high − low)), with uniform cubic B-splines B_i (C. de Boor, A Practical Guide to Splines, 2001),
constant beyond the ends. "Unknown physics" means such a map instead of named effects. Several effects that are laws of the same
quantity together approximate one law; the map shows whether one law would suffice.
"""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from rhythmid.elements.element import Element, Parameter, Slot
from rhythmid.model import Model

Array = NDArray[np.float64]
COEFFICIENTS = 10
MARGIN = 0.05  # share of its quantity's range by which a map extends beyond the range on either side
LEAST_RANGE = 1e-9  # range of a map whose quantity never changes, as a share of the quantity's size


def _force(x, v, t, f, low, high, share, c0, c1, c2, c3, c4, c5, c6, c7, c8, c9):
    z = (1.0 - share) * x + share * v
    if z != z:  # NaN: the run has diverged
        return z
    s = min(max((z - low) / (high - low) * 7.0, 0.0), 7.0 - 1e-12)
    i = int(s)
    u = s - i
    c = (c0, c1, c2, c3, c4, c5, c6, c7, c8, c9)
    w = 1.0 - u
    first = w * w * w * c[i] + (3.0 * u * u * u - 6.0 * u * u + 4.0) * c[i + 1]
    second = (3.0 * w * w * w - 6.0 * w * w + 4.0) * c[i + 2] + u * u * u * c[i + 3]
    return (first + second) / 6.0


def _signal(z, t, low, high, c0, c1, c2, c3, c4, c5, c6, c7, c8, c9):
    if z != z:
        return z
    s = min(max((z - low) / (high - low) * 7.0, 0.0), 7.0 - 1e-12)
    i = int(s)
    u = s - i
    c = (c0, c1, c2, c3, c4, c5, c6, c7, c8, c9)
    w = 1.0 - u
    first = w * w * w * c[i] + (3.0 * u * u * u - 6.0 * u * u + 4.0) * c[i + 1]
    second = (3.0 * w * w * w - 6.0 * w * w + 4.0) * c[i + 2] + u * u * u * c[i + 3]
    return z + (first + second) / 6.0


def _element(name: str, slot: Slot, quantity: str, share: float | None = None) -> Element:
    """The element for one quantity; for a force, `share` is 0 for the position and 1 for the velocity."""
    chosen = (
        ()
        if share is None
        else (Parameter("share", "1", "0 position, 1 velocity", default=share, fixed=True),)
    )
    return Element(
        name=name,
        slot=slot,
        title=f"Free map of the {quantity}",
        equation="Σ c_i B_i",
        parameters=(
            Parameter("low", "1", "where the map begins", fixed=True),
            Parameter("high", "1", "where the map ends", fixed=True),
            *chosen,
            *(Parameter(f"c{i}", "1", f"coefficient {i}") for i in range(COEFFICIENTS)),
        ),
        kernel=_signal if share is None else _force,
        candidate=False,
        reference="C. de Boor, A Practical Guide to Splines, 2001, chapter IX",
    )


FREE_MAPS: Mapping[str, Element] = {
    "position": _element("free_force_of_position", "force", "position", 0.0),
    "velocity": _element("free_force_of_velocity", "force", "velocity", 1.0),
    "effort": _element("free_actuator_map", "actuator", "actuator's force"),
    "signal": _element("free_sensor_map", "sensor", "measurement"),
}


def first_guess(values: Array) -> dict[str, float]:
    """Values of a map that is zero over the range of a quantity (n,)."""
    low, high = (float(end) for end in np.quantile(values, [0.0, 1.0]))
    margin = max(MARGIN * (high - low), LEAST_RANGE * max(abs(low), abs(high)), LEAST_RANGE**2)
    return {"low": low - margin, "high": high + margin} | {f"c{i}": 0.0 for i in range(COEFFICIENTS)}


def without_free_maps(model: Model) -> Model:
    """The model without its free maps, which a model file cannot contain."""
    for term in model.terms:
        if term.element in FREE_MAPS.values():
            model = model.without(term.label)
    return model
