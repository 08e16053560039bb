"""The concealed machine: a mass on a spring with a direction-switched damper, and up to two further effects.

Integrated by the embedded Runge-Kutta pair of J. R. Dormand and P. J. Prince (J. Comput. Appl. Math. 6 (1980) 19) with
step-size control, restarted wherever the held command jumps. It shares no code with the simulator that is fitted.
"""

import warnings
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
from numba import boolean, float64, int64, njit, types
from numba.core.errors import NumbaExperimentalFeatureWarning
from numpy.typing import NDArray

from rhythmid.proof.equations import (
    AMPLITUDE,
    DAMPING,
    EQUATIONS,
    FREQUENCY,
    GRAVITY,
    MASS,
    PHASE,
    PLACES,
    REST_LENGTH,
    STIFFNESS,
)

Array = NDArray[np.float64]
MOST = 2  # effects at once
WARM_UP = 10.0  # [s] that the machine has run before a record begins
RELATIVE, ABSOLUTE = 1e-8, 1e-11  # error allowed in a step
SHORTEST = 1e-8  # [s] step below which no accuracy is asked for: inside a jump
FAR = 1e3  # [m] beyond which the machine has diverged

COMMAND, ACTUATOR, LEG, CONTACT, BODY, SENSOR = range(len(PLACES))
NOWHERE = -1
numbers = float64[::1]
SIGNATURE = float64(
    float64, float64, float64, float64, float64, numbers, numbers, numbers, numbers, numbers, boolean
)
EFFECTS = types.UniTuple(types.FunctionType(SIGNATURE), MOST)
whole = int64[::1]
table = int64[:, ::1]


@dataclass(frozen=True)
class Machine:
    """Mass [kg], stiffness [N/m], damping while v > 0 [N s/m], rest length [m], gravity [m/s²] (0: it lies flat)."""

    mass: float
    stiffness: float
    damping: float
    rest_length: float
    gravity: float


@dataclass(frozen=True)
class Forcing:
    """amplitude [N] cos(2π frequency [Hz] t + phase), made on the robot."""

    amplitude: float
    frequency: float
    phase: float

    def __call__(self, time: Array) -> Array:
        return self.amplitude * np.cos(2.0 * np.pi * self.frequency * time + self.phase)


@dataclass(frozen=True)
class Effect:
    """One concealed effect: its name and its parameters by name."""

    name: str
    parameters: dict[str, float]


@dataclass(frozen=True)
class Observation:
    """What a record holds, before noise: stamps [s] and values of the measurement; the motion itself for reference."""

    stamps: Array
    measured: Array
    position: Array
    velocity: Array


def _nothing(value, t, x, v, f, m, p, s, ds, held, accepted):
    return value


@njit(
    float64(int64, float64, float64, float64, float64, float64, EFFECTS, whole, table, numbers, numbers, numbers,
            numbers, numbers, boolean),
    cache=True,
)  # fmt: skip
def through(place, value, t, x, v, f, effects, places, layout, m, p, s, ds, held, accepted):
    """The signal `value` after all effects at its place."""
    for i in range(MOST):
        if places[i] == place:
            value = effects[i](
                value, t, x, v, f, m, p[layout[i, 0] : layout[i + 1, 0]],
                s[layout[i, 1] : layout[i + 1, 1]], ds[layout[i, 1] : layout[i + 1, 1]],
                held[layout[i, 2] : layout[i + 1, 2]], accepted,
            )  # fmt: skip
    return value


@njit(
    float64(float64, numbers, float64, EFFECTS, whole, table, numbers, numbers, numbers, boolean, numbers),
    cache=True,
)
def rates(t, z, u, effects, places, layout, m, p, held, accepted, dz):
    """Write the rates of the states z = (x, v, …) and return the measured position; u is the command in force."""
    x, v, s, ds = z[0], z[1], z[2:], dz[2:]
    f = through(COMMAND, u, t, x, v, 0.0, effects, places, layout, m, p, s, ds, held, accepted)
    f += m[AMPLITUDE] * np.cos(2.0 * np.pi * m[FREQUENCY] * t + m[PHASE])
    f = through(ACTUATOR, f, t, x, v, 0.0, effects, places, layout, m, p, s, ds, held, accepted)
    leg = -m[STIFFNESS] * (x - m[REST_LENGTH])
    if v > 0.0:
        leg -= m[DAMPING] * v
    leg = through(LEG, leg, t, x, v, f, effects, places, layout, m, p, s, ds, held, accepted)
    leg = through(CONTACT, leg, t, x, v, f, effects, places, layout, m, p, s, ds, held, accepted)
    total = f + leg - m[MASS] * m[GRAVITY]
    total = through(BODY, total, t, x, v, f, effects, places, layout, m, p, s, ds, held, accepted)
    dz[0] = v
    dz[1] = total / m[MASS]
    return through(SENSOR, x, t, x, v, f, effects, places, layout, m, p, s, ds, held, accepted)


@njit(
    int64(EFFECTS, whole, table, numbers, numbers, numbers, numbers, float64, numbers, numbers, numbers,
          float64[:, ::1]),
    cache=True,
)  # fmt: skip
def integrate(effects, places, layout, m, p, held, z, begin, knots, values, samples, out):
    """Integrate from `begin` through all `samples`; rows of `out` become x, v, measured position.

    The command is 0 before the first of its `knots` and `values[j]` from knots[j] on. Returns how many rows are good.
    """
    n = len(z)
    k1, k2, k3, k4 = np.zeros(n), np.zeros(n), np.zeros(n), np.zeros(n)
    k5, k6, k7, trial = np.zeros(n), np.zeros(n), np.zeros(n), np.zeros(n)
    t, u, j = begin, 0.0, 0
    h = 1e-4
    for i in range(len(samples)):
        while t < samples[i]:
            while j < len(knots) and knots[j] <= t:
                u = values[j]
                j += 1
            stop = samples[i]
            if j < len(knots) and knots[j] < stop:
                stop = knots[j]
            # the command may just have jumped: what remembers has to see it
            rates(t, z, u, effects, places, layout, m, p, held, True, k1)
            while t < stop:
                last = h >= stop - t
                step = stop - t if last else h
                for q in range(n):
                    trial[q] = z[q] + step * k1[q] / 5.0
                rates(t + step / 5.0, trial, u, effects, places, layout, m, p, held, False, k2)
                for q in range(n):
                    trial[q] = z[q] + step * (3.0 * k1[q] + 9.0 * k2[q]) / 40.0
                rates(t + 0.3 * step, trial, u, effects, places, layout, m, p, held, False, k3)
                for q in range(n):
                    trial[q] = z[q] + step * (44.0 / 45.0 * k1[q] - 56.0 / 15.0 * k2[q] + 32.0 / 9.0 * k3[q])
                rates(t + 0.8 * step, trial, u, effects, places, layout, m, p, held, False, k4)
                for q in range(n):
                    trial[q] = z[q] + step * (
                        19372.0 / 6561.0 * k1[q] - 25360.0 / 2187.0 * k2[q] + 64448.0 / 6561.0 * k3[q]
                        - 212.0 / 729.0 * k4[q]
                    )  # fmt: skip
                rates(t + 8.0 / 9.0 * step, trial, u, effects, places, layout, m, p, held, False, k5)
                for q in range(n):
                    trial[q] = z[q] + step * (
                        9017.0 / 3168.0 * k1[q] - 355.0 / 33.0 * k2[q] + 46732.0 / 5247.0 * k3[q]
                        + 49.0 / 176.0 * k4[q] - 5103.0 / 18656.0 * k5[q]
                    )  # fmt: skip
                rates(t + step, trial, u, effects, places, layout, m, p, held, False, k6)
                for q in range(n):
                    trial[q] = z[q] + step * (
                        35.0 / 384.0 * k1[q] + 500.0 / 1113.0 * k3[q] + 125.0 / 192.0 * k4[q]
                        - 2187.0 / 6784.0 * k5[q] + 11.0 / 84.0 * k6[q]
                    )  # fmt: skip
                rates(t + step, trial, u, effects, places, layout, m, p, held, False, k7)
                worst = 0.0
                for q in range(n):
                    error = step * (
                        71.0 / 57600.0 * k1[q] - 71.0 / 16695.0 * k3[q] + 71.0 / 1920.0 * k4[q]
                        - 17253.0 / 339200.0 * k5[q] + 22.0 / 525.0 * k6[q] - k7[q] / 40.0
                    )  # fmt: skip
                    allowed = ABSOLUTE + RELATIVE * max(abs(z[q]), abs(trial[q]))
                    worst = max(worst, abs(error) / allowed)
                if not np.isfinite(worst):
                    return i
                growth = 5.0 if worst == 0.0 else min(5.0, max(0.2, 0.9 * worst**-0.2))
                if worst > 1.0 and step > SHORTEST:
                    h = max(step * growth, SHORTEST)
                    continue
                t = stop if last else t + step
                z[:] = trial
                rates(t, z, u, effects, places, layout, m, p, held, True, k1)
                h = max(h, step * growth) if last else max(step * growth, SHORTEST)
            if abs(z[0]) > FAR:
                return i
        out[i, 0], out[i, 1] = z[0], z[1]
        out[i, 2] = rates(t, z, u, effects, places, layout, m, p, held, False, k1)
    return len(samples)


@lru_cache(maxsize=64)
def _compiled(name: str) -> Any:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", NumbaExperimentalFeatureWarning)
        return njit(SIGNATURE, cache=True)(EQUATIONS[name].function if name else _nothing)


def held_command(arrival: Array, value: Array, period: float) -> tuple[Array, Array]:
    """What a drive makes of commands when it looks for a new one only at multiples of `period` [s]."""
    ticks = period * np.arange(np.ceil(arrival[0] / period), np.ceil(arrival[-1] / period) + 1)
    newest = np.searchsorted(arrival, ticks + 1e-9, side="right") - 1
    return ticks[newest >= 0], value[newest[newest >= 0]]


def stamp(taken: Array, delay: float, effects: Sequence[Effect]) -> Array:
    """Stamps [s] of measurements by when they were taken [s]: late by the delay, on a clock that may run wrong."""
    stamps = taken + delay
    for effect in effects:
        if effect.name == "clock_skew":
            stamps = stamps * (1.0 + effect.parameters["skew"])
        elif effect.name == "delay_drift":
            stamps = stamps / (1.0 - effect.parameters["rate"])
    return stamps


TIMING = ("command_hold", "input_delay_drift", "clock_skew", "delay_drift")  # effects that are no equation


def observe(
    machine: Machine,
    effects: Sequence[Effect],
    forcing: Forcing,
    time: Array,
    command: Array,
    input_delay: float = 0.0,
    measurement_delay: float = 0.0,
) -> Observation | None:
    """Run the machine through one record.

    `time` (n,) [s] are the instants at which commands (n,) [N] are sent and measurements taken. None if it diverges.
    """
    arrival, value = time + input_delay, np.ascontiguousarray(command, dtype=float)
    for effect in effects:
        if effect.name == "input_delay_drift":
            arrival = arrival + effect.parameters["rate"] * time
    for effect in effects:
        if effect.name == "command_hold":
            arrival, value = held_command(arrival, value, effect.parameters["period"])
    inside = [effect for effect in effects if effect.name not in TIMING]
    known = [EQUATIONS[effect.name] for effect in inside]
    spare = MOST - len(known)
    functions = tuple(_compiled(effect.name) for effect in inside) + (_compiled(""),) * spare
    places = np.array([PLACES.index(one.place) for one in known] + [NOWHERE] * spare)
    widths = [(len(one.parameters), len(one.states), one.held) for one in known] + [(0, 0, 0)] * spare
    layout = np.vstack([np.zeros((1, 3), int), np.cumsum(widths, axis=0)]).astype(np.int64)
    parameters = [effect.parameters[name] for effect, one in zip(inside, known) for name in one.parameters]
    rest = machine.rest_length - machine.mass * machine.gravity / machine.stiffness
    start = np.array([rest, 0.0, *(share * rest for one in known for share in one.states)])
    held = np.zeros(sum(one.held for one in known))
    constants = np.array(
        [machine.mass, machine.stiffness, machine.damping, machine.rest_length, machine.gravity,
         forcing.amplitude, forcing.frequency, forcing.phase]
    )  # fmt: skip
    out = np.empty((len(time), 3))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", NumbaExperimentalFeatureWarning)
        done = integrate(
            functions, places, layout, constants, np.array(parameters, dtype=float), held, start,
            float(time[0] - WARM_UP), np.ascontiguousarray(arrival, dtype=float), value,
            np.ascontiguousarray(time, dtype=float), out,
        )  # fmt: skip
    if done < len(time) or not np.isfinite(out).all():
        return None
    return Observation(stamp(time, measurement_delay, effects), out[:, 2], out[:, 0], out[:, 1])
