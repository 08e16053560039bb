"""How wrong a command may be where it was not recorded: what moves the machine by less than the noise of the measurement."""

import numpy as np

from rhythmid.record.interpolation import interpolation_errors
from rhythmid.record.record import Channel

EXACT = (
    1e-4  # of the motion, below which an error of the command counts for nothing however small the noise is
)


@np.errstate(over="ignore", invalid="ignore")  # of numbers near the largest
def tolerable_error(output: Channel) -> float:
    """Error of a command, as a share of its size times its duration [s], that moves the machine by less than the noise.

    An impulse J changes the speed by J/m. A command of size U moves a mass at the speed w of its motion by about U/(m w²), so
    that the share e of U during T moves it by the share e w T.
    """
    value, span = output.value - output.value.mean(), output.time[-1] - output.time[0]
    size = float(np.std(value))
    speed = float(np.sqrt(np.sum(np.diff(value) ** 2 / np.diff(output.time)) / span))
    if speed == 0.0 or size == 0.0:
        return 0.0
    return max(interpolation_errors(value, np.ones(1, dtype=np.int64))[0] / size, EXACT) * size / speed
