"""The force that a controller with known gains makes of its reference, along the motion that was measured.

The reference passes what the command path does to it: delays, a hold, a lag, a limit of its rate; the controller then works on the motion.
A reference that is held from sample to sample is on average half a sample old. A controller that works once in a step holds its
force for that step: its reference is on average half a step younger than its stamp says, and the velocity that it takes is that of the step
before, half a step old (the steps of a symplectic Euler method, as MuJoCo takes them).
"""

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from rhythmid.model import Model
from rhythmid.simulation.effect import Path, effect_along

if TYPE_CHECKING:
    from rhythmid.identify.inverse_dynamics.motion import Motion

Array = NDArray[np.float64]
ON_TICK = 1e-9  # [s] within which a command that has arrived counts as there


@dataclass(frozen=True, eq=False)
class Reference:
    """A controller's reference on the samples of its record, before the command path.

    Attributes
    ----------
    time, value : (m,) [s] and the reference there.
    forward : (n,) force that is added behind the controller, at the samples of the motion; None where there is none.
    age : by how much older [s] than its stamp a reference is on average when it acts, beside the delays of the path.
    step : [s] for which the controller holds its force.
    cut : [Hz] bandwidth of the motion, above which nothing is compared.
    every : samples of the record for one of the motion.
    """

    time: Array
    value: Array
    forward: Array | None
    age: float
    step: float
    cut: float
    every: int

    def force(self, model: Model, motion: "Motion", late: float = 0.0) -> Array:
        """Force (n,) that the controller of a model asks for along a motion, its reference `late` [s] beyond the model's delays."""
        from rhythmid.identify.inverse_dynamics.motion import low_pass

        command = [term for term in model.terms if term.element.slot == "command"]
        signal, shift = self.value, self.age + late
        for term in command:
            if term.element.delay is None:
                continue
            delays = term.element.delay(self.time, **term.numbers)
            if np.ptp(delays) == 0.0:
                shift += float(delays[0])
            else:
                signal = _held(self.time, signal, delays)
        for term in command:
            if term.element.acts == "leg" and term.element.kernel is not None:
                still = np.full(len(signal), motion.position[0])
                path = Path(self.time, still, 0.0 * still, signal, 0.0 * still, signal)
                signal = signal + effect_along(term.element, term.numbers, model, path)
        asked = np.interp(self.time - shift, self.time, signal)
        asked = low_pass(asked, float(self.time[1] - self.time[0]), self.cut)[:: self.every]
        position, velocity = motion.position, motion.velocity - 0.5 * self.step * motion.acceleration
        total = np.zeros(len(position))
        for term in command:
            if term.element.acts == "observation":
                ago = motion.time - term.numbers[term.element.dead_time]
                ago = np.maximum(ago, motion.time[0])
                position, velocity = (CubicSpline(motion.time, one)(ago) for one in (position, velocity))
        for term in command:
            if term.element.acts == "feedback" and term.element.kernel is not None:
                total = term.element.kernel(asked, position, velocity, motion.time, **term.numbers)
        return total if self.forward is None else total + self.forward


def changed_by(model: Model) -> tuple[tuple[str, tuple[float, ...]], ...]:
    """The command path's terms with their values: what a controller's force depends on beside the motion."""
    return tuple(
        (term.label, tuple(value.value for value in term.values.values()))
        for term in model.terms
        if term.element.slot == "command"
    )


def _held(time: Array, signal: Array, delays: Array) -> Array:
    """A signal (m,) whose samples act at their stamps and these delays (m,) [s], and last until the next one acts."""
    acting = np.maximum.accumulate(time + delays)
    last = np.searchsorted(acting, time + ON_TICK, side="right") - 1
    return signal[np.maximum(last, 0)]
