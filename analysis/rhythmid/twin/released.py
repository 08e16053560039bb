"""Release times of commands: if a relay is late, commands act later than stamp and delay imply."""

import numpy as np
from numpy.typing import NDArray

from rhythmid.twin.lateness import LOOK, lateness
from rhythmid.twin.samples import Samples

Array = NDArray[np.float64]
APART = 1e-9  # [s] between commands that were released together


class Released:
    """Corrects the times of commands for a late release.

    The corrected time is the stamp that a punctually released command would have, if released at the same time.

    Parameters
    ----------
    delay : from a command's stamp to its release [s].
    """

    def __init__(self, delay: float) -> None:
        self.given, self.released = Samples(), Samples()
        self._delay = delay
        self._newest = -np.inf

    def take(self, silent: float) -> tuple[Array, Array]:
        """Times [s] (n,) and values (n,) of the commands whose lateness is now known; each command is returned once.

        Commands stamped before `silent` [s] are always returned.
        """
        released, given = self.released.time, self.given
        until = max(silent, self.released.newest - self._delay - LOOK)
        count = int(np.searchsorted(given.time, until, side="right"))
        time, value = given.time[:count], given.value[:count]
        given.time, given.value = given.time[count:], given.value[count:]
        if count and len(released) > 1:
            late = lateness(released, float(np.median(np.diff(released))))
            time = time + np.interp(time + self._delay, released - late, late, left=0.0, right=0.0)
            self.released.forget(float(time[0]) - LOOK)
        time = np.maximum.accumulate(np.concatenate([[self._newest], time]))[1:]
        time = np.asarray(time + APART * np.arange(1, count + 1), dtype=np.float64)
        self._newest = float(time[-1]) if count else self._newest
        return time, value
