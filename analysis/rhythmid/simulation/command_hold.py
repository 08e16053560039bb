"""A command that is not renewed ends: it is held for a while, then fades to zero.

The rule is the same in the plant node, in a run without ROS and in the last node before a robot. It is independent
of the clock: time is whole nanoseconds of the clock that stamps the commands.
"""

import math

import numpy as np
from numpy.typing import NDArray

TIMEOUT = 0.1
"""Default hold [s]: a hundred samples at 1 kHz, and a fraction of a period of the rhythmic machines that are played on."""

RAMP = 0.02
"""Default length of the ramp to zero [s]: short beside `TIMEOUT`, long beside the reaction time of a drive."""

_RENEWALS = 2  # least sample periods for which a command is held: with fewer, a punctual sender could lapse


class CommandHold:
    """The command in force.

    Parameters
    ----------
    timeout : [s] time for which a command is held without renewal; at least two sample periods; 0: for ever.
    ramp : [s] time in which it then fades to zero, in steps of a sample period.
    period_ns : sample period [ns] of the commands.

    Attributes
    ----------
    effort : the effort in force [N] after the last call.
    lapses : number of nonzero commands that were not renewed in time.
    """

    def __init__(self, timeout: float, ramp: float, period_ns: int) -> None:
        self.effort = 0.0
        self.lapses = 0
        self._timeout_ns = max(round(timeout * 1e9), _RENEWALS * period_ns) if timeout > 0.0 else math.inf
        self._steps = max(1, round(ramp * 1e9 / period_ns))
        self._period_ns = period_ns
        self._renewed_ns = 0
        self._given = 0.0
        self._step = 0  # index of the next step of the ramp

    def renew(self, stamp_ns: int, effort: float) -> None:
        """A command [N] that holds from `stamp_ns` on."""
        self._renewed_ns, self._given, self.effort, self._step = stamp_ns, effort, effort, 0

    def until(self, stamp_ns: int) -> list[tuple[int, float]]:
        """The steps of the ramp up to `stamp_ns` that have not been returned yet: (stamp [ns], effort [N])."""
        steps: list[tuple[int, float]] = []
        if self._given == 0.0 or stamp_ns - self._renewed_ns < self._timeout_ns:
            return steps
        begin_ns = self._renewed_ns + int(self._timeout_ns)
        last = min(self._steps, (stamp_ns - begin_ns) // self._period_ns + 1)
        self.lapses += self._step == 0
        for step in range(self._step, last):
            self.effort = self._given * (1.0 - (step + 1) / self._steps)
            steps.append((begin_ns + step * self._period_ns, self.effort))
        self._step = last
        return steps

    def fill(
        self, stamp_ns: NDArray[np.int64], effort: NDArray[np.float64]
    ) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
        """Commands with increasing stamps, shapes (n,), with the steps of the ramp added where they pause too long."""
        if len(stamp_ns) == 0:
            return stamp_ns, effort
        stamps: list[int] = []
        efforts: list[float] = []
        begin = 0
        pauses = np.flatnonzero(np.diff(stamp_ns, prepend=self._renewed_ns) > self._timeout_ns)
        for pause in pauses.tolist():
            if pause > begin:
                self.renew(int(stamp_ns[pause - 1]), float(effort[pause - 1]))
            down = self.until(int(stamp_ns[pause]) - 1)
            stamps += [*stamp_ns[begin:pause].tolist(), *(stamp for stamp, _ in down)]
            efforts += [*effort[begin:pause].tolist(), *(value for _, value in down)]
            begin = pause
        self.renew(int(stamp_ns[-1]), float(effort[-1]))
        if not stamps:
            return stamp_ns, effort
        return (
            np.array([*stamps, *stamp_ns[begin:].tolist()], dtype=np.int64),
            np.array([*efforts, *effort[begin:].tolist()]),
        )
