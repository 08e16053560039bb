"""What drives a series, as the compiled loop takes it: made when it is asked for, and shared by all series with the same
signals: of long records they are most of what has to be held in memory."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import PPoly

from rhythmid.record.timing import BURSTS, nominal_period
from rhythmid.simulation.signal import FAR, impulse_preserving, is_held, pieces

Array = NDArray[np.float64]
Pieces = tuple[Array, Array]
SMOOTHED_FROM = 16  # knots of a command that has a smooth surrogate, more than these
# knots of a command from which its pieces are made anew for each run. Measured at 300 000 of them: 1 % of the run's time for a held command
# and 4 % for a cubic one, whose pieces would hold 5 and 12 MB
LONG = 100_000


@dataclass(frozen=True, eq=False)
class Inputs:
    """Command and forcing of a series, or of several."""

    commanded: PPoly | None
    forced: PPoly | None

    @property
    def stamps(self) -> Array:
        """Knots (k,) of the command [s], before any delay; empty without one."""
        if self.commanded is None:
            return np.empty(0)
        knots = self.commanded.x
        return knots[:-1] if knots[-1] > FAR / 2 else knots

    @property
    def command(self) -> Pieces:
        """The command, before any delay; that of a long record is not kept."""
        if self.commanded is None or len(self.commanded.x) < LONG:
            return self._short_command
        return pieces(self.commanded)

    @cached_property
    def _short_command(self) -> Pieces:
        return pieces(self.commanded)

    @cached_property
    def forcing(self) -> Pieces:
        """The forcing."""
        return pieces(self.forced)

    @cached_property
    def even_tick(self) -> float:
        """Usual time [s] between the knots of a held command; infinite where there is none, or where its times are uneven."""
        command = self.commanded
        if command is None or not is_held(command) or len(command.x) <= SMOOTHED_FROM:
            return np.inf
        step = np.diff(command.x[:-1])
        usual = nominal_period(step)
        return np.inf if float(np.median(step)) < BURSTS * usual else usual

    @cached_property
    def smooth(self) -> Pieces:
        """Smooth surrogate for the command, which is held at an even tick."""
        assert self.commanded is not None
        return pieces(impulse_preserving(self.commanded))
