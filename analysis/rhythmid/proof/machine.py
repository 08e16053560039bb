"""The concealed machine: a mass or a joint with spring, damper and weight, and up to five further effects.

It may have a controller or a moved base. Its integrator is in `rhythmid.proof.integrator`.
"""

import warnings
from collections.abc import Sequence
from dataclasses import astuple, dataclass
from typing import Literal

import numpy as np
from numba.core.errors import NumbaExperimentalFeatureWarning
from numpy.typing import NDArray

from rhythmid.proof.equations import EQUATIONS, PLACES
from rhythmid.proof.integrator import (
    BASE,
    COLUMNS,
    CONTINUOUS,
    FORCE,
    MOST_EFFECTS,
    NOWHERE,
    SAMPLED_POSITION,
    SAMPLED_VELOCITY,
    compiled,
    integrate,
)

Array = NDArray[np.float64]
Mode = Literal["force", "base", "continuous", "sampled_position", "sampled_velocity"]
MODES: dict[Mode, int] = {
    "force": FORCE, "base": BASE, "continuous": CONTINUOUS, "sampled_position": SAMPLED_POSITION,
    "sampled_velocity": SAMPLED_VELOCITY,
}  # fmt: skip
WARM_UP = 10.0  # [s] that a machine on its limit cycle runs before a record begins
NO_SLOPES = np.empty(0)


@dataclass(frozen=True)
class Machine:
    """The machine without effects, in SI units, linear or rotational, or in any consistent units.

    Mass [kg], stiffness [N/m], damping while v > 0 [N s/m], rest length [m], gravity [m/s²] (0: it lies flat), damping while
    v < 0 [N s/m] (a hopper has none in flight), moment of a pendulum's gravity [N m] and the angle at which it hangs [rad].
    Controller gains, if there is one: on the error [N/m] (of a velocity controller [N s/m]), on the speed [N s/m] and on the
    error's integral. `sliding` [m/s] is the speed over which dry friction changes sign. `mode` is the meaning of the command.
    """

    mass: float
    stiffness: float
    damping: float
    rest_length: float
    gravity: float
    return_damping: float = 0.0
    moment: float = 0.0
    hanging: float = 0.0
    proportional: float = 0.0
    derivative: float = 0.0
    integral: float = 0.0
    sliding: float = 1e-4
    mode: Mode = "force"

    @property
    def rest(self) -> float:
        """Rest position [m] of a machine with a spring; 0 for one without."""
        return self.rest_length - self.mass * self.gravity / self.stiffness if self.stiffness else 0.0


@dataclass(frozen=True)
class Forcing:
    """amplitude [N] cos(2π frequency [Hz] t + phase), made on the robot."""

    amplitude: float
    frequency: float
    phase: float

    def __call__(self, time: Array) -> Array:
        return self.amplitude * np.cos(2.0 * np.pi * self.frequency * time + self.phase)


UNFORCED = Forcing(0.0, 1.0, 0.0)


@dataclass(frozen=True)
class Effect:
    """One concealed effect: its name and its parameters by name."""

    name: str
    parameters: dict[str, float]


@dataclass(frozen=True)
class Observation:
    """A record before noise.

    Stamps [s] and values of the measurement, and the force [N] of a sampled controller; for reference also the motion itself and
    the force [N] that all effects together added.
    """

    stamps: Array
    measured: Array
    position: Array
    velocity: Array
    acceleration: Array
    added: Array
    effort: Array


def constants(machine: Machine, forcing: Forcing, velocity: bool = False) -> Array:
    """The constants m of the equations; `velocity`: the velocity is measured."""
    values = astuple(machine)
    return np.array([*values[:5], *astuple(forcing), *values[5:12], float(velocity)])


def held_command(arrival: Array, value: Array, period: float) -> tuple[Array, Array]:
    """Command of a drive that takes a new command only at multiples of `period` [s]: instants and values."""
    ticks = period * np.arange(np.ceil(arrival[0] / period), np.ceil(arrival[-1] / period) + 1)
    newest = np.searchsorted(arrival, ticks + 1e-9, side="right") - 1
    return ticks[newest >= 0], value[newest[newest >= 0]]


def stamp(taken: Array, delay: float, effects: Sequence[Effect]) -> Array:
    """Stamps [s] of measurements from the times [s] at which they were taken: late by the delay, from a clock that may be wrong."""
    stamps = taken + delay
    for effect in effects:
        if effect.name == "clock_skew":
            stamps = stamps * (1.0 + effect.parameters["skew"])
        elif effect.name == "delay_drift":
            stamps = stamps / (1.0 - effect.parameters["rate"])
    return stamps


TIMING = ("command_hold", "input_delay_drift", "clock_skew", "delay_drift")  # effects without an equation


def observe(
    machine: Machine,
    effects: Sequence[Effect],
    forcing: Forcing,
    time: Array,
    command: Array,
    input_delay: float = 0.0,
    measurement_delay: float = 0.0,
    *,
    slopes: Array | None = None,
    start: tuple[float, float] | None = None,
    velocity: bool = False,
    samples: Array | None = None,
    lag: float = 0.0,
) -> Observation | None:
    """Run the machine through one record; None if it diverges.

    `time` (n,) [s] are the instants at which commands (n,) [N] are sent and, unless `samples` are given, measurements taken. The
    command is held, or smooth with `slopes` (n,). With a `start`, position [m] and velocity [m/s], the machine is released there
    at the first instant; otherwise it is already running. `velocity`: the velocity is measured. Measurements are taken `lag` [s]
    before their nominal time.
    """
    taken = np.ascontiguousarray(time if samples is None else samples, dtype=float)
    arrival, value = time + input_delay, np.ascontiguousarray(command, dtype=float)
    for effect in effects:
        if effect.name == "input_delay_drift":
            arrival = arrival + effect.parameters["rate"] * time
    for effect in effects:
        if effect.name == "command_hold":
            arrival, value = held_command(arrival, value, effect.parameters["period"])
    inside = [effect for effect in effects if effect.name not in TIMING]
    known = [EQUATIONS[effect.name] for effect in inside]
    spare = MOST_EFFECTS - len(known)
    functions = tuple(compiled(effect.name) for effect in inside) + (compiled(""),) * spare
    places = np.array([PLACES.index(one.place) for one in known] + [NOWHERE] * spare)
    widths = [(len(one.parameters), len(one.states), one.held) for one in known] + [(0, 0, 0)] * spare
    layout = np.vstack([np.zeros((1, 3), int), np.cumsum(widths, axis=0)]).astype(np.int64)
    parameters = [effect.parameters[name] for effect, one in zip(inside, known) for name in one.parameters]
    begin, (position, speed) = (time[0] - WARM_UP, (machine.rest, 0.0)) if start is None else (time[0], start)
    # a servo starts at its first reference
    before = position if machine.mode == "continuous" and start is not None else 0.0
    first = np.array([position, speed, *(share * position for one in known for share in one.states)])
    held = _memory(machine, inside, position, float(begin))
    out, efforts = np.empty((len(taken), COLUMNS)), np.zeros(len(arrival))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", NumbaExperimentalFeatureWarning)
        done = integrate(
            functions, places, layout, constants(machine, forcing, velocity), np.array(parameters, dtype=float), held,
            first, float(begin), np.ascontiguousarray(arrival, dtype=float), value,
            NO_SLOPES if slopes is None else np.ascontiguousarray(slopes, dtype=float), MODES[machine.mode],
            taken - lag, out, efforts, before,
        )  # fmt: skip
    if done < len(taken) or not np.isfinite(out).all():
        return None
    efforts[-1:] = efforts[-2:-1]  # the last output acts after the last sample
    return Observation(
        stamp(taken, measurement_delay, effects),
        out[:, 2],
        out[:, 0],
        out[:, 1],
        out[:, 4],
        out[:, 3],
        efforts,
    )


def _memory(machine: Machine, effects: Sequence[Effect], position: float, begin: float) -> Array:
    """Initial memory of the effects: zero, except for a rate limit of the reference, which begins at the machine's position."""
    held: list[float] = []
    for effect in effects:
        ramp = effect.name == "reference_rate_limit"
        held += [position, begin] if ramp else [0.0] * EQUATIONS[effect.name].held
    return np.array(held, dtype=float)
