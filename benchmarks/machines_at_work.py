"""Running machines for the benchmark of the live twin: drawn about three designs, simulated piece by piece."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rhythmid.elements.catalogue import load_catalogue
from rhythmid.excitation.multisine import Multisine
from rhythmid.model import Model
from rhythmid.simulation.compiled import compile_model
from rhythmid.simulation.signal import spline, zero_order_hold
from rhythmid.simulation.simulate import simulate, start_states

Array = NDArray[np.float64]
RATE = 250.0  # Hz
NOISE = (1e-3, 1e-2)  # of the motion's standard deviation
SPREAD = 0.2  # of every free parameter, about its design
DESIGNS = {
    "hopper": """
inertia: {mass: {value: 1.0, unit: kg, fixed: true}}
command: [{input_delay: {delay: {value: 0.02, unit: s}}}]
force:
  - gravity: {acceleration: {value: 9.81, unit: m/s^2, fixed: true}}
  - linear_spring: {stiffness: {value: 200.0, unit: N/m}, rest_length: {value: 0.2, unit: m}}
  - switched_damper: {stance: {value: 2.0, unit: N*s/m}, flight: {value: 0.0, unit: N*s/m, fixed: true}}
sensor: [{measurement_delay: {delay: {value: 0.03, unit: s}}}]
""",
    "lift": """
inertia: {mass: {value: 2.0, unit: kg, fixed: true}}
command: [{input_delay: {delay: {value: 0.01, unit: s}}}]
force:
  - gravity: {acceleration: {value: 9.81, unit: m/s^2, fixed: true}}
  - linear_spring: {stiffness: {value: 800.0, unit: N/m}, rest_length: {value: 0.0, unit: m}}
  - viscous_damper: {damping: {value: 8.0, unit: N*s/m}}
  - coulomb_friction: {force: {value: 1.0, unit: N}, transition: {value: 0.005, unit: m/s, fixed: true}}
sensor: [{measurement_delay: {delay: {value: 0.005, unit: s}}}]
""",
    "joint": """
inertia: {mass: {value: 0.05, unit: kg*m^2}}
command: [{input_delay: {delay: {value: 0.008, unit: s}}}]
force:
  - linear_spring: {stiffness: {value: 3.0, unit: N*m/rad}, rest_length: {value: 0.0, unit: rad, fixed: true}}
  - viscous_damper: {damping: {value: 0.05, unit: N*m*s/rad}}
  - coulomb_friction: {force: {value: 0.03, unit: N*m}, transition: {value: 0.02, unit: rad/s, fixed: true}}
sensor: [{measurement_delay: {delay: {value: 0.0, unit: s, fixed: true}}}]
""",
}
DRIVES = {  # amplitude [N] and frequency [Hz] of the forcing, rms [N] of the excitation
    "hopper": (1.0, 1.0, 0.25),
    "lift": (6.0, 1.4, 5.0),
    "joint": (0.0, 1.0, 0.25),
}


@dataclass(frozen=True)
class Machine:
    """A machine as drawn, with its forcing, excitation and noise."""

    name: str
    truth: Model
    forcing: tuple[float, float]
    rms: float
    noise: float
    correlation: float


def drawn(name: str, rng: np.random.Generator) -> Machine:
    """A machine about a design."""
    design = Model.from_text(DESIGNS[name], name, load_catalogue())
    values = {n: design.value(n) * rng.uniform(1.0 - SPREAD, 1.0 + SPREAD) for n in design.free}
    amplitude, frequency, rms = DRIVES[name]
    share = float(np.exp(rng.uniform(*np.log(NOISE))))
    return Machine(
        name, design.with_values(values), (amplitude, frequency), rms, share, rng.choice([0.0, 0.5])
    )


@dataclass(frozen=True)
class Stretch:
    """Signals of a time span: times [s], command and forcing [N], the measurement [m] with its stamps [s]; the state at the end."""

    time: Array
    command: Array
    forcing: Array
    stamp: Array
    measured: Array
    end: Array

    @property
    def channels(self) -> list[tuple[Any, Array, Array]]:
        """Role, times and values of each signal."""
        return [
            ("input", self.time, self.command),
            ("forcing", self.time, self.forcing),
            ("output", self.stamp, self.measured),
        ]

    def then(self, other: Stretch) -> Stretch:
        """These signals and the following ones, whose first sample is the last of these."""

        def joined(name: str) -> Array:
            return np.concatenate([getattr(self, name)[:-1], getattr(other, name)])

        return Stretch(
            joined("time"),
            joined("command"),
            joined("forcing"),
            joined("stamp"),
            joined("measured"),
            other.end,
        )


class Operation:
    """A running machine with one excitation and one noise; the excitation repeats with other phases from chunk to chunk."""

    def __init__(self, machine: Machine, seed: int) -> None:
        self.machine = machine
        self.random = np.random.default_rng([seed, 1])
        self.excitation = Multisine(rms=machine.rms, period=20.0, periods=1, band=(0.3, 8.0), seed=seed)
        tau = machine.truth.value("measurement_delay.delay")
        self.delay = tau
        self.before = np.zeros(1)
        quiet = self._simulated(machine.truth, 0.0, 30.0, self._rest())
        self.std = machine.noise * float(np.std(quiet.measured))
        self.coloured = 0.0

    def _rest(self) -> Array:
        model = self.machine.truth
        weight = model.mass.value * 9.81 if model.term("gravity") is not None else 0.0
        rest = model.value("linear_spring.rest_length") - weight / model.value("linear_spring.stiffness")
        return start_states(model, compile_model(model.without("measurement_delay")), rest, 0.0)

    def command(self, times: Array) -> Array:
        """The command [N] at its stamps [s]."""
        return self.excitation(np.mod(times, self.excitation.period))

    def _simulated(self, model: Model, start: float, end: float, state: Array) -> Stretch:
        """Without noise."""
        delay = model.value("measurement_delay.delay")
        time = np.arange(round(start * RATE), round(end * RATE) + 1) / RATE
        known = np.arange(round((start - 0.2) * RATE), round(end * RATE) + 1) / RATE
        amplitude, frequency = self.machine.forcing
        forcing = amplitude * np.cos(2.0 * np.pi * frequency * known)
        run = simulate(
            model.without("measurement_delay"), time, zero_order_hold(known, self.command(known)),
            spline(known, forcing), state,
        )  # fmt: skip
        first = len(known) - len(time)
        return Stretch(time, self.command(time), forcing[first:], time + delay, run.output, run.states[-1])

    def run(self, model: Model, start: float, end: float, state: Array | None = None) -> Stretch:
        """The running machine from `start` to `end` [s] as `model`, from a state, or from rest."""
        made = self._simulated(model, start, end, self._rest() if state is None else state)
        rho = self.machine.correlation
        white = self.std * np.sqrt(1.0 - rho**2) * self.random.standard_normal(len(made.time))
        noise = np.empty(len(white))
        for k, one in enumerate(white):
            self.coloured = rho * self.coloured + one
            noise[k] = self.coloured
        return replace(made, measured=made.measured + noise)
