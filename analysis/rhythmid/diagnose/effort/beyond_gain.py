"""Share of an actuator's law, along the recorded efforts, that is more than a gain.

The balance computes the effort along a smoothed motion. That effort passes through all values between the levels of a
switched effort, which the actuator never saw. On two levels ±a every odd law is a gain, which the inertia and the forces
already contain.
"""

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from rhythmid.diagnose.static_law import curved, law_of
from rhythmid.elements.element import Scales
from rhythmid.identify.inverse_dynamics.motion import effort_channel
from rhythmid.model import Model
from rhythmid.record.record import Record
from rhythmid.simulation.effect import Path, effect_along

Array = NDArray[np.float64]


def recorded_efforts(records: Sequence[Record], model: Model) -> Array | None:
    """The efforts (n,) at their own stamps; None where none was recorded, or where a forcing adds to the recorded one."""
    found: list[Array] = []
    for record in records:
        channel = effort_channel(record, model)
        if channel is None:
            return None
        if record.effort is None and (record.forcing is not None or record.forcing_law is not None):
            return None
        found.append(channel.value)
    return np.concatenate(found) if found else None


def beyond_gain(model: Model, label: str, sizes: Scales, recorded: Array, required: Array) -> float:
    """Action of an actuator's law beyond a gain and a constant, recorded efforts relative to required ones.

    Parameters
    ----------
    model, label : the model and the label of the law.
    sizes : scales of the records.
    recorded : (n,) recorded efforts.
    required : (m,) efforts that the model requires.

    Returns
    -------
    float
        Ratio of the mean squares; infinite for an effect that is no static law of the effort, or a straight one.
    """
    term = model.term(label)
    if term is None:
        return math.inf
    values = term.numbers
    if law_of(term.element, values, model, sizes) is None:
        return math.inf

    def beyond(efforts: Array) -> float:
        still = np.zeros(len(efforts))
        path = Path(still, still, still, efforts, still, efforts)
        return float(np.mean(curved(effect_along(term.element, values, model, path), efforts) ** 2))

    whole = beyond(required)
    return beyond(recorded) / whole if whole > 0.0 else math.inf
