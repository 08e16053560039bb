"""Force scoring: each simulation is tied by an observer to the record that it is compared with.

Where a machine integrates, or sticks and slips, a free run adds up every small disturbance until it means nothing. Tied to
the record it cannot get far: what it stays behind by is the force that the model lacks, seen through
1 / (m (s² + d s + k)). This is inverse dynamics without a derivative of the measurement: force and simulation are compared
below the observer's bandwidth, and all else goes on as in a free run. A machine of which the velocity was measured is
drawn by the damper alone; what it lags behind is the force over m (s + d).
"""

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import PPoly

from rhythmid.identify.observer import Observer
from rhythmid.identify.series import Series
from rhythmid.model import Model
from rhythmid.simulation.signal import spline

Array = NDArray[np.float64]
FINER = 4  # times as many averages a second in the motion that pulls as in those that are compared


def observed(series: Sequence[Series], model: Model, frequency: float) -> list[Series]:
    """The series, each tied to its record by an observer of this frequency [Hz]: critically damped where the position was
    measured, a damper alone where the velocity was."""
    omega = 2.0 * math.pi * frequency
    found = []
    for one in series:
        motion = _motion(one.time, one.value, max(1, one.block // FINER))
        if one.measured == "velocity":
            stiffness, damping = 0.0, omega
            holds, pull = damping, PPoly(damping * motion.c, motion.x, extrapolate=True)
        else:
            stiffness, damping = omega**2, 2.0 * omega
            rate = motion.derivative()
            cubic = np.vstack([np.zeros((1, rate.c.shape[1])), rate.c])
            holds, pull = stiffness, PPoly(stiffness * motion.c + damping * cubic, motion.x, extrapolate=True)
        effort = sum(
            (part(one.centres) for part in (one.command, one.forcing) if part is not None),
            np.zeros(one.blocks),
        )
        size = float(np.std(effort)) / (model.mass.value * holds)
        found.append(replace(one, observer=Observer(stiffness, damping, pull, size)))
    return found


def _motion(time: Array, value: Array, block: int) -> PPoly:
    """Spline through averages of the measurement, which a bent motion moves by a 24th of its second difference."""
    count = len(time) // block
    centres, averages = (a[: count * block].reshape(count, block).mean(axis=1) for a in (time, value))
    bend = np.zeros(count)
    bend[1:-1] = np.diff(averages, 2)
    return spline(centres, averages - (1.0 - 1.0 / block**2) / 24.0 * bend)
