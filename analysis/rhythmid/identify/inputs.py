"""What drives a series, as the compiled loop takes it: made when it is asked for, once, and shared by all runs over the series."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import PPoly

from rhythmid.record.timing import BURSTS, nominal_period
from rhythmid.simulation.signal import FAR, impulse_preserving, pieces

Array = NDArray[np.float64]
Pieces = tuple[Array, Array]
SMOOTHED_FROM = 16  # knots of a command that has a smooth surrogate, more than these


@dataclass(frozen=True)
class Inputs:
    """The signals of a series; `period` [s] is that of its samples, `averaged` whether several of them are averaged into one."""

    commanded: PPoly | None
    forced: PPoly | None
    period: float
    averaged: bool

    @property
    def stamps(self) -> Array:
        """Knots (k,) of the command [s], before any delay; empty without one."""
        if self.commanded is None:
            return np.empty(0)
        knots = self.commanded.x
        return knots[:-1] if knots[-1] > FAR / 2 else knots

    @cached_property
    def command(self) -> Pieces:
        """The command, before any delay."""
        return pieces(self.commanded)

    @cached_property
    def forcing(self) -> Pieces:
        """The forcing."""
        return pieces(self.forced)

    @cached_property
    def smooth(self) -> Pieces | None:
        """Smooth surrogate for a held command that changes about as often as the measurement is sampled, or more often, and at even
        times; None where there is none."""
        command = self.commanded
        if command is None or command.c.shape[0] > 1 or len(command.x) <= SMOOTHED_FROM or not self.averaged:
            return None
        step = np.diff(command.x[:-1])
        usual = nominal_period(step)
        if usual > 2.0 * self.period * (1.0 + 1e-6) or float(np.median(step)) < BURSTS * usual:
            return None
        return pieces(impulse_preserving(command))
