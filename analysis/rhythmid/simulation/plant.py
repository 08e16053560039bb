"""The simulator with commands as they arrive, used by the plant node and by the offline run of an experiment.

Time is whole nanoseconds since the start of the run. The result depends only on the commands and their stamps, not
on the chunks in which they arrive: a step never crosses a sample or a command, so the steps are the same for any
chunks.
"""

from bisect import bisect_right
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rhythmid.errors import InputError
from rhythmid.model import Model
from rhythmid.simulation.compiled import NO_HISTORY, compile_model
from rhythmid.simulation.history import BEGIN
from rhythmid.simulation.signal import FAR
from rhythmid.simulation.simulate import MAX_STEP, samplers, start_states
from rhythmid.simulation.transport import CommandPath, physical_times

Array = NDArray[np.float64]
Stamps = NDArray[np.int64]
TRANSPORT = ("input_delay", "measurement_delay")  # in the ROS graph these are the delay injectors


@dataclass(frozen=True)
class Samples:
    """Plant output at grid times; arrays of shape (n,). `position` [m] is the sensor's value, before any transport
    delay. `velocity` [m/s] is the true one, `effort` [N] the total actuator force, `forcing` [N] the part generated
    on the robot."""

    stamp_ns: Stamps
    position: Array
    velocity: Array
    effort: Array
    forcing: Array


def forcing_at(model: Model, times: Array) -> Array:
    """Forcing f0 [N] that the model generates at physical times [s]; shapes (n,) -> (n,)."""
    total = np.zeros(len(times))
    for term in model.terms:
        if term.element.acts == "drive" and term.element.kernel is not None:
            values = term.numbers
            total += [term.element.kernel(float(t), **values) for t in times]
    return total


def settled(model: Model, periods: int = 120, tolerance: float = 1e-12) -> tuple[Array, Array]:
    """State vector at t = 0 of the forced, uncommanded model on its limit cycle, after `periods` at most, and the
    history that elements with a dead time need there.

    Without forcing the machine comes to rest. Starts from rest at the first spring's rest length.
    """
    compiled = compile_model(model)
    period = next(
        (1.0 / t.values["frequency"].value for t in model.terms
         if t.element.acts == "drive" and "frequency" in t.values and t.values["frequency"].value > 0), 1.0
    )  # fmt: skip
    state = start_states(model, compiled, model.borrowed("linear_spring.rest_length", 0.0) or 0.0, 0.0)
    parameters = compiled.layout.vector(model)
    knots, zero, past = np.array([-FAR, FAR]), np.zeros((4, 1)), NO_HISTORY
    for count in range(periods, 0, -1):
        times = np.array([-count * period, -(count - 1) * period])
        out = np.empty((2, len(state) + 2))
        done, past = compiled.resume(
            times, knots, zero, knots, zero, knots, zero, parameters, state, MAX_STEP, out, past
        )
        if done < 2:
            raise InputError(
                "the model diverges under its forcing; check its parameters or give an initial state"
            )
        before, state = state, np.ascontiguousarray(out[-1, : len(state)])
        if np.allclose(before, state, rtol=tolerance, atol=tolerance):
            if past.size:
                past[:, BEGIN] -= times[1]
            break
    return state, past


class Plant:
    """A running model with commands as they arrive.

    `period_ns` is the sample period [ns]. `initial` is (position, velocity), a full state, or None for the settled
    machine. `seed` drives the model's noise. The model's own transport delays are left out: see `TRANSPORT`.
    """

    def __init__(
        self, model: Model, period_ns: int, seed: int = 0, initial: tuple[float, float] | Array | None = None
    ) -> None:
        for name in TRANSPORT:
            while model.term(name) is not None:
                model = model.without(name)
        self._model = model
        self._period = period_ns
        self._compiled = compile_model(model)
        self._parameters = self._compiled.layout.vector(model)
        self._samplers = samplers(model, seed)
        self._path = CommandPath(model)
        self._past = NO_HISTORY
        if initial is None:
            self._state, self._past = settled(model)
        else:
            start = np.asarray(initial, dtype=float)
            self._state = start_states(model, self._compiled, *start) if start.shape == (2,) else start
        self._next = 0  # index of the next grid sample
        self._time = 0.0
        self._knots: list[float] = []
        self._efforts: list[float] = []
        self._held = 0.0
        self._newest = -1

    def push(self, stamp_ns: int, effort: float) -> None:
        """A command [N] that holds from its stamp on. Raises InputError when stamps do not increase."""
        self.push_many(np.array([stamp_ns], dtype=np.int64), np.array([effort]))

    def push_many(self, stamp_ns: Stamps, effort: Array) -> None:
        """Commands with increasing stamps; shapes (n,), (n,)."""
        if len(stamp_ns) == 0:
            return
        if stamp_ns[0] <= self._newest or np.any(np.diff(stamp_ns) <= 0):
            raise InputError(f"commands must come in the order of their stamps (at {int(stamp_ns[0])} ns)")
        if not np.isfinite(effort).all():
            raise InputError(f"a command is not a finite number (at {int(stamp_ns[0])} ns)")
        self._newest = int(stamp_ns[-1])
        self._knots.extend(self._path.times(np.asarray(stamp_ns * 1e-9, dtype=float)).tolist())
        self._efforts.extend(np.asarray(effort, dtype=float).tolist())

    def advance(self, until_ns: int) -> Samples:
        """All grid samples up to `until_ns` that have not been returned yet; all commands stamped up to then must
        be known.

        Raises InputError when the simulation diverges.
        """
        last = until_ns // self._period
        stamps = np.arange(self._next, last + 1, dtype=np.int64) * self._period
        if len(stamps) == 0:
            none = np.empty(0)
            return Samples(stamps, none, none, none, none)
        grid = (stamps * 1e-9).astype(np.float64)
        physical = np.maximum(physical_times(self._model, grid), self._time)
        first = self._next == 0
        times = physical if first else np.concatenate([[self._time], physical])
        knots = np.array([-FAR, *self._knots, FAR])
        coefficients = np.zeros((4, len(knots) - 1))
        coefficients[0] = [self._held, *self._efforts]
        no_knots, zero = np.array([-FAR, FAR]), np.zeros((4, 1))
        n = len(self._state)
        out = np.empty((len(times), n + 2))
        done, past = self._compiled.resume(
            times,
            knots,
            coefficients,
            no_knots,
            zero,
            no_knots,
            zero,
            self._parameters,
            self._state,
            MAX_STEP,
            out,
            self._past,
        )
        if done < len(times) or not np.isfinite(out[-1]).all():
            raise InputError(
                f"the plant diverges at t = {times[min(done, len(times) - 1)]:.3f} s; check its parameters"
            )
        rows = out if first else out[1:]
        self._next = int(last) + 1
        self._time = float(times[-1])
        self._state, self._past = np.ascontiguousarray(out[-1, :n]), past
        past = bisect_right(self._knots, self._time)
        if past:
            self._held = self._efforts[past - 1]
            del self._knots[:past], self._efforts[:past]
        position = rows[:, n].copy()
        for sample in self._samplers:
            position = sample(grid, position)
        return Samples(
            stamps, position, rows[:, 1].copy(), rows[:, n + 1].copy(), forcing_at(self._model, grid)
        )
