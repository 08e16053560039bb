"""What an actuator's law does to the recorded efforts beyond a gain.

The balance computes the effort along a smoothed motion, which passes through all values between the levels of a switched effort.
The actuator never met those. On two levels of one size every odd law is a gain, which the inertia and the forces have already.
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
    """The efforts (n,) at their own stamps; None where nothing was recorded, or a forcing is added to what was."""
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
    """Mean square of what a law of the actuator does to the `recorded` efforts (n,) beyond a gain and a constant, as a share of what
    it does to those (m,) that the model requires; infinite for what is no static law of the effort, or straight there."""
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
