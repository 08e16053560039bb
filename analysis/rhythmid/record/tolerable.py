"""Tolerable error of a command where it was not recorded: its effect on the motion is below the measurement noise."""

import numpy as np

from rhythmid.record.interpolation import interpolation_errors
from rhythmid.record.record import Channel

# share of the motion below which an error of the command is negligible, however small the noise is
EXACT = 1e-4


@np.errstate(over="ignore", invalid="ignore")  # for numbers near the largest
def tolerable_error(output: Channel) -> float:
    """Error of a command, as a share of its size times its duration [s], whose effect on the motion is below the noise.

    An impulse J changes the speed by J/m. A command of size U moves a mass by about U/(m w²), with w the angular
    frequency of its motion. So an error e U during a time T changes the motion by the share e w T.
    """
    value, span = output.value - output.value.mean(), output.time[-1] - output.time[0]
    size = float(np.std(value))
    speed = float(np.sqrt(np.sum(np.diff(value) ** 2 / np.diff(output.time)) / span))
    if speed == 0.0 or size == 0.0:
        return 0.0
    return max(interpolation_errors(value, np.ones(1, dtype=np.int64))[0] / size, EXACT) * size / speed
