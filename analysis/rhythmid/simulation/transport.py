"""Transport delays of a model: delay of a command's action after its stamp, and age of a measurement.

An element of the command path, the sensor or the timing that only delays gives its delay by its function `delay`,
which is called only here. Dead times inside a loop act on the past of a signal: they belong to the compiled
simulator (`history`).
"""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import PPoly

from rhythmid.model import Model, Term
from rhythmid.simulation.signal import FOR_EVER

Array = NDArray[np.float64]
INPUT_DELAY, MEASUREMENT_DELAY = "input_delay.delay", "measurement_delay.delay"  # parameters of a model
MEASUREMENT = ("sensor", "timing")  # slots on the path of a measurement


def delays(model: Model, stamps: Array, *slots: str) -> Iterator[tuple[Term, Array]]:
    """The elements of these slots with a delay, each with its delay (n,) [s] at stamps (n,) [s]."""
    for term in model.terms:
        if term.element.delay is not None and term.element.slot in slots:
            yield term, _delay(term, stamps)


def _delay(term: Term, stamps: Array) -> Array:
    assert term.element.delay is not None
    return term.element.delay(stamps, **term.numbers)


def physical_times(model: Model, stamps: Array) -> Array:
    """Times [s] at which the measurements stamped `stamps` [s] were taken: stamps minus delay, skew and jitter of
    the model.

    A measurement cannot overtake an earlier one.
    """
    times, varies = np.asarray(stamps, dtype=float), False
    for _, late in delays(model, stamps, *MEASUREMENT):
        varies = varies or _varies(late)
        times = times - late
    return np.maximum.accumulate(times) if varies else times


class CommandPath:
    """The delays of a model's command path, one element after another, for commands in the order of their stamps,
    given at once or in chunks. A command cannot overtake an earlier one."""

    def __init__(self, model: Model) -> None:
        self._terms = [t for t in model.terms if t.element.slot == "command" and t.element.delay is not None]
        self._last = [-np.inf] * len(self._terms)

    def times(self, stamps: Array) -> Array:
        """Times (n,) [s] at which commands stamped `stamps` (n,) [s] act."""
        acting = stamps
        for _, passed in self.stages(stamps):
            acting = passed
        return acting

    def stages(self, stamps: Array) -> Iterator[tuple[Array, Array]]:
        """For each element its own delays (n,) [s], and the times (n,) [s] at which the commands leave it."""
        for index, term in enumerate(self._terms):
            late = _delay(term, stamps)
            stamps = stamps + late
            if _varies(late):
                stamps = np.maximum.accumulate(stamps)
            if len(stamps) and self._last[index] > -np.inf:
                stamps = np.maximum(stamps, self._last[index])
            if len(stamps):
                self._last[index] = float(stamps[-1])
            yield late, stamps


def command_delay(model: Model, stamps: Array) -> Array | None:
    """Delays (n,) [s] of commands stamped `stamps` [s]; None where the command path has no delay."""
    late = acting_delay(model, stamps)
    return late if late is None or isinstance(late, np.ndarray) else np.full(len(stamps), late)


def acting_delay(model: Model, stamps: Array) -> Array | float | None:
    """As `command_delay`, but one number [s] where all commands have the same delay."""
    stages = list(CommandPath(model).stages(stamps))
    if not stages:
        return None
    if any(_varies(late) for late, _ in stages):
        late = stages[-1][1] - stamps
        return late if _varies(late) else float(late[0])
    return float(sum(float(late[0]) for late, _ in stages if len(late)))


def delayed_command(model: Model, command: PPoly | None) -> PPoly | None:
    """The command as it acts on the machine: its knots are shifted by the delays of the command path."""
    if command is None:
        return None
    finite = command.x < FOR_EVER
    knots = np.concatenate([CommandPath(model).times(command.x[finite]), command.x[~finite]])
    return PPoly(command.c, knots, extrapolate=True)


def _varies(late: Array) -> bool:
    return len(late) > 0 and bool(late.max() > late.min())
