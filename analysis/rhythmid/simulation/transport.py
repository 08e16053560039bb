"""Transport delays of a model: by how much later than its stamp a command acts, and how old a measurement is.

An element of the command path, the sensor or the timing that only delays says by how much in its function `delay`; nothing else
calls it. Dead times inside a loop act on the past of a signal: they belong to the compiled simulator (`history`).
"""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import PPoly

from rhythmid.model import Model, Term
from rhythmid.simulation.signal import FOR_EVER

Array = NDArray[np.float64]
INPUT_DELAY, MEASUREMENT_DELAY = "input_delay.delay", "measurement_delay.delay"  # parameters of a model
MEASUREMENT = ("sensor", "timing")  # slots that a measurement passes


def delays(model: Model, stamps: Array, *slots: str) -> Iterator[tuple[Term, Array]]:
    """The elements of these slots that delay, each with its own delay (n,) [s] at stamps (n,) [s]."""
    for term in model.terms:
        if term.element.delay is not None and term.element.slot in slots:
            yield term, _delay(term, stamps)


def _delay(term: Term, stamps: Array) -> Array:
    assert term.element.delay is not None
    return term.element.delay(stamps, **term.numbers)


def physical_times(model: Model, stamps: Array) -> Array:
    """When the measurements stamped `stamps` [s] were taken: stamps less delay, skew and jitter of the model.

    A measurement cannot overtake an earlier one.
    """
    times, varies = np.asarray(stamps, dtype=float), False
    for _, late in delays(model, stamps, *MEASUREMENT):
        varies = varies or _varies(late)
        times = times - late
    return np.maximum.accumulate(times) if varies else times


class CommandPath:
    """The delays of a model's command path, one element after another, for commands in the order of their stamps, fed whole or
    in chunks. A command cannot overtake an earlier one."""

    def __init__(self, model: Model) -> None:
        self._terms = [t for t in model.terms if t.element.slot == "command" and t.element.delay is not None]
        self._last = [-np.inf] * len(self._terms)

    def times(self, stamps: Array) -> Array:
        """When commands stamped `stamps` [s] act; (n,) -> (n,)."""
        acting = stamps
        for _, passed in self.stages(stamps):
            acting = passed
        return acting

    def stages(self, stamps: Array) -> Iterator[tuple[Array, Array]]:
        """Of each element its own delays (n,) [s], and when the commands have passed it (n,) [s]."""
        for index, term in enumerate(self._terms):
            late = _delay(term, stamps)
            stamps = stamps + late
            if _varies(late):
                stamps = np.maximum.accumulate(stamps)
            if len(stamps):
                stamps = np.maximum(stamps, self._last[index])
                self._last[index] = float(stamps[-1])
            yield late, stamps


def command_delay(model: Model, stamps: Array) -> Array | None:
    """Delays (n,) [s] of commands stamped `stamps` [s]; None where nothing in the command path delays."""
    stages = list(CommandPath(model).stages(stamps))
    if not stages:
        return None
    if any(_varies(late) for late, _ in stages):
        return stages[-1][1] - stamps
    return np.full(len(stamps), sum((float(late[0]) for late, _ in stages if len(late)), 0.0))


def delayed_command(model: Model, command: PPoly | None) -> PPoly | None:
    """The command as it acts on the machine: its knots moved by the delays of the command path."""
    if command is None:
        return None
    finite = command.x < FOR_EVER
    knots = np.concatenate([CommandPath(model).times(command.x[finite]), command.x[~finite]])
    return PPoly(command.c, knots, extrapolate=True)


def _varies(late: Array) -> bool:
    return len(late) > 0 and bool(np.ptp(late) > 0.0)
