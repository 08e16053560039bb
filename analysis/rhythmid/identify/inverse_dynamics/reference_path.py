"""The force that a controller with known gains commands for its reference, along the measured motion.

The reference first passes the command path: delays, a hold, a lag, a rate limit. Then the controller acts on the
motion. A reference that is held between samples is on average half a sample old. A controller that runs once per
step holds its force for that step. Therefore its reference is on average half a step younger than its timestamp
says. The velocity it uses is that of the previous step and half a step old (steps of a symplectic Euler method, as
in MuJoCo).
"""

from collections.abc import Hashable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from rhythmid.model import Model, Term
from rhythmid.simulation.effect import Path, effect_along

if TYPE_CHECKING:
    from rhythmid.identify.inverse_dynamics.motion import Motion

Array = NDArray[np.float64]
ON_TICK = 1e-9  # [s] tolerance within which a command counts as arrived
KEPT = 16  # cached references behind a command path: those of the steps of one fit
# [s] times with irrational ratios at which a delay is evaluated to see whether it varies
PROBED = (0.0, 0.0137, 0.3711, 1.9173)


@dataclass(frozen=True, eq=False)
class Commanded:
    """The reference of a joint over a whole record, before the command path: timestamps [s] (m,) and values (m,).
    The path has memory, so the reference is passed through it from the start of the record, where the joint is at
    `start`."""

    time: Array
    value: Array
    start: float
    _passed: dict[Hashable, Array] = field(default_factory=dict, repr=False)

    def passed(self, model: Model) -> Array:
        """The reference (m,) after the command path, without its constant delays; the last results are cached."""
        key = changed_by(model)
        if key not in self._passed:
            if len(self._passed) >= KEPT:
                self._passed.clear()
            self._passed[key] = self._through(model)
        return self._passed[key]

    def _through(self, model: Model) -> Array:
        command, signal = [term for term in model.terms if term.element.slot == "command"], self.value
        for term in command:
            if term.element.delay is None:
                continue
            delays = term.element.delay(self.time, **term.numbers)
            if np.ptp(delays) > 0.0:
                signal = _held(self.time, signal, delays)
        for term in command:
            if term.element.acts == "leg" and term.element.kernel is not None:
                still = np.full(len(signal), self.start)
                path = Path(self.time, still, 0.0 * still, signal, 0.0 * still, signal)
                signal = signal + effect_along(term.element, term.numbers, model, path)
        return signal

    def late(self, model: Model) -> float:
        """Sum of the command path's constant delays [s]."""
        return sum((_constant(term) for term in model.terms), 0.0)


def _constant(term: Term) -> float:
    """The delay [s] of a term if it is the same for all commands; 0 where it varies or where the term has none."""
    element = term.element
    if element.slot != "command" or element.delay is None:
        return 0.0
    delays = element.delay(np.array(PROBED), **term.numbers)
    return float(delays[0]) if np.ptp(delays) == 0.0 else 0.0


@dataclass(frozen=True, eq=False)
class Reference:
    """A controller's reference along one motion.

    Attributes
    ----------
    commanded : the reference over the whole record; the motion is its `part`.
    forward : (n,) force that is added after the controller, at the samples of the motion; None where there is none.
    age : mean age [s] of a reference when it acts, relative to its timestamp, without the delays of the path.
    step : [s] time for which the controller holds its force.
    cut : [Hz] bandwidth of the motion, above which nothing is compared.
    every : samples of the record per sample of the motion.
    """

    commanded: Commanded
    part: slice
    forward: Array | None
    age: float
    step: float
    cut: float
    every: int

    def force(self, model: Model, motion: "Motion", late: float = 0.0) -> Array:
        """Force (n,) that a model's controller commands along a motion, with its reference `late` [s] later than
        the model's delays."""
        from rhythmid.identify.inverse_dynamics.motion import low_pass

        command = [term for term in model.terms if term.element.slot == "command"]
        shift, time = self.age + self.commanded.late(model) + late, self.commanded.time
        asked = np.interp(time[self.part] - shift, time, self.commanded.passed(model))
        asked = low_pass(asked, float(time[1] - time[0]), self.cut)[:: self.every]
        position, velocity = motion.position, motion.velocity - 0.5 * self.step * motion.acceleration
        total = np.zeros(len(position))
        for term in command:
            if term.element.acts == "observation":
                ago = np.maximum(motion.time - term.numbers[term.element.dead_time], motion.time[0])
                position, velocity = (CubicSpline(motion.time, one)(ago) for one in (position, velocity))
        for term in command:
            if term.element.acts == "feedback" and term.element.kernel is not None:
                total = term.element.kernel(asked, position, velocity, motion.time, **term.numbers)
        return total if self.forward is None else total + self.forward


def changed_by(model: Model) -> tuple[tuple[str, tuple[float, ...]], ...]:
    """The command path's terms with their values: all that a controller's force depends on besides the motion."""
    return tuple(
        (term.label, tuple(value.value for value in term.values.values()))
        for term in model.terms
        if term.element.slot == "command"
    )


def _held(time: Array, signal: Array, delays: Array) -> Array:
    """A signal (m,) whose samples act at their timestamps plus these delays (m,) [s], and are held until the next
    one acts."""
    acting = np.maximum.accumulate(time + delays)
    last = np.searchsorted(acting, time + ON_TICK, side="right") - 1
    return signal[np.maximum(last, 0)]
