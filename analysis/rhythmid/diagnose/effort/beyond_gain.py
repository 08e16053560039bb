"""What an actuator's law does to the recorded efforts beyond a gain.

The balance computes the effort along a smoothed motion, which passes through all values between the levels of a switched effort.
The actuator never met those. On two levels of one size every odd law is a gain, which the inertia and the forces have already.
"""

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from rhythmid.diagnose.static_law import law_of
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


def beyond_gain(model: Model, label: str, sizes: Scales, efforts: Array, removed: float) -> float:
    """Mean square of what a law of the actuator does to these efforts (n,) beyond a gain and a constant, as a share of the mean
    squared error that it has `removed`; infinite for what is no static law of the effort, or where nothing was removed."""
    term = model.term(label)
    if term is None or removed <= 0.0:
        return math.inf
    values = {name: value.value for name, value in term.values.items()}
    if law_of(term.element, values, model, sizes) is None:
        return math.inf
    still = np.zeros(len(efforts))
    effect = effect_along(term.element, values, model, Path(still, still, still, efforts, still, efforts))
    columns = np.column_stack([efforts, np.ones(len(efforts))])
    straight = np.linalg.lstsq(columns, effect, rcond=None)[0]
    gain = 1.0 + float(
        straight[0]
    )  # an error of the effort that leaves is so many times that of the one that enters
    left = effect - columns @ straight
    return float(np.mean(left**2)) / (gain**2 * removed) if gain != 0.0 else math.inf
