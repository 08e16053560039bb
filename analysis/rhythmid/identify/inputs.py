"""Driving signals of a series in the form of the compiled loop. They are made on demand and shared by all series
with the same signals, because those of long records take most of the memory."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import PPoly

from rhythmid.record.timing import BURSTS, nominal_period
from rhythmid.simulation.signal import FAR, impulse_preserving, is_held, pieces

Array = NDArray[np.float64]
Pieces = tuple[Array, Array]
SMOOTHED_FROM = 16  # number of knots above which a command gets a smooth surrogate
# number of a command's knots above which its pieces are rebuilt for each run. Measured at 300 000 knots: 1 % of the
# run's time for a held command and 4 % for a cubic one, whose pieces would take 5 and 12 MB
LONG = 100_000


@dataclass(frozen=True, eq=False)
class Inputs:
    """Command and forcing of a series, or of several."""

    commanded: PPoly | None
    forced: PPoly | None

    @property
    def stamps(self) -> Array:
        """Knots (k,) of the command [s], before any delay; empty without a command."""
        if self.commanded is None:
            return np.empty(0)
        knots = self.commanded.x
        return knots[:-1] if knots[-1] > FAR / 2 else knots

    @property
    def command(self) -> Pieces:
        """The command, before any delay; not cached for a long record."""
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
    def tick(self) -> float:
        """Usual time [s] between the knots of the command; infinite without two of them."""
        knots = np.empty(0) if self.commanded is None else self.commanded.x[:-1]
        return nominal_period(np.diff(knots)) if len(knots) > 2 else np.inf

    @cached_property
    def even_tick(self) -> float:
        """Usual time [s] between the knots of a held command; infinite without one, or where its times are uneven."""
        command = self.commanded
        if command is None or not is_held(command) or len(command.x) <= SMOOTHED_FROM:
            return np.inf
        return np.inf if float(np.median(np.diff(command.x[:-1]))) < BURSTS * self.tick else self.tick

    @cached_property
    def smooth(self) -> Pieces:
        """Smooth surrogate of a command that is held at even intervals."""
        assert self.commanded is not None
        return pieces(impulse_preserving(self.commanded))
