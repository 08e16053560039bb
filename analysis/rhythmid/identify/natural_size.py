"""Natural size of a parameter: the value at which it would matter, from its unit and the scales of the records.

The parameter's own value is no scale for its uncertainty: with a true value of 0 every standard deviation exceeds
it. A length is scaled by the motion, a force by the driving force, a time by the motion's period. A coefficient is
scaled by the ratio of such a force to such a motion: a damper of that size takes all of the force.
"""

import math
from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from rhythmid.elements.element import Scales
from rhythmid.elements.first_guess import powers
from rhythmid.identify.record_scales import scales
from rhythmid.identify.series import Series
from rhythmid.model import INERTIA, Model

Array = NDArray[np.float64]


def natural_size(unit: str, known: Scales) -> float | None:
    """Size of a parameter by its unit, for a translational machine; None where the unit is not mechanical."""
    radian = 1.0 / (2.0 * math.pi * known.frequency)
    sizes = {
        "N": known.effort,
        "m": known.position,
        "s": radian,
        "Hz": 1.0 / radian,
        "kg": known.mass,
        "rad": 1.0,
    }
    found = dict(powers(unit))
    if not set(found) <= set(sizes):
        return None
    return math.prod(sizes[name] ** power for name, power in found.items())


def is_told(value: float, std: float, natural: float | None) -> bool:
    """Whether something is known of a parameter: its standard deviation is below its value, or two of them are below its natural size.

    Else the parameter may be absent as well as all that there is.
    """
    return std < (max(abs(value), (natural or 0.0) / 2.0) or 1.0)


def are_told(
    model: Model, series: Sequence[Series], estimates: Mapping[str, tuple[float, float]]
) -> set[str]:
    """Those of the `estimates`, name -> value and standard deviation, of which the records tell something; see `is_told`."""
    known, units = scales(series, model), _units(model)
    return {name for name, given in estimates.items() if is_told(*given, natural_size(units[name], known))}


def sizes_of(model: Model, names: Sequence[str], series: Sequence[Series]) -> Array:
    """Sizes (p,) that scale changes of the parameters `names`: natural sizes, or the values where these are larger.

    A time is always scaled by the motion's period / 2π: two delays that far apart are two phases.
    """
    known = scales(series, model)
    units = _units(model)
    found = []
    for name in names:
        natural, value = natural_size(units[name], known), abs(model.value(name))
        found.append(natural if units[name] == "s" else max(value, natural or 0.0) or 1.0)
    return np.array(found)


def _units(model: Model) -> dict[str, str]:
    """Units of a translational machine, by parameter."""
    return {INERTIA: "kg"} | {
        f"{term.label}.{one.name}": one.unit for term in model.terms for one in term.element.parameters
    }
