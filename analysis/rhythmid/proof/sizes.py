"""How large each concealed effect may be, and its other parameters: drawn at random within what is physical.

An effect's `strength` runs from 0 (absent) to 1 (as much as any machine would have); which strength is taken is settled
later by the mismatch that it leaves.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rhythmid.proof.machine import Forcing, Machine, Observation
from rhythmid.proof.protocol import Run

Array = NDArray[np.float64]
Rng = np.random.Generator
Sized = Callable[[float], dict[str, float]]  # strength -> parameters


@dataclass(frozen=True)
class Motion:
    """What the machine does in the experiments without the effect: the yardstick of every effect."""

    machine: Machine
    unit: float  # amplitude of the forcing [N]
    natural: float  # natural angular frequency [rad/s]
    pumping: float  # [Hz]
    position: float  # standard deviation [m] over all records
    velocity: float  # [m/s]
    cycle: float  # amplitude of the limit cycle [m]
    low: float  # [m] ends of the motion, a thousandth of the time left out
    high: float
    centre: float
    stretch: float  # largest |x - rest length| [m]
    effort: float  # largest |forcing + command| [N]
    slope: float  # largest rate of forcing + command [N/s]
    duration: float  # [s] longest record
    shortest: float


def motion_of(machine: Machine, forcing: Forcing, runs: tuple[Run, ...], seen: list[Observation]) -> Motion:
    """Sizes of the motion in the records `seen`, which came of `runs`."""
    x = np.concatenate([one.position for one in seen])
    v = np.concatenate([one.velocity for one in seen])
    efforts = [
        forcing.amplitude * run.forcing * np.cos(2.0 * np.pi * forcing.frequency * run.time) + run.command
        for run in runs
    ]
    cycle = next(one for run, one in zip(runs, seen) if run.shape == "silence")
    low, high = np.quantile(x, [0.001, 0.999])
    return Motion(
        machine=machine,
        unit=forcing.amplitude,
        natural=math.sqrt(machine.stiffness / machine.mass),
        pumping=forcing.frequency,
        position=float(np.std(x)),
        velocity=float(np.std(v)),
        cycle=float(np.std(cycle.position)) * math.sqrt(2.0),
        low=float(low),
        high=float(high),
        centre=float(np.mean(x)),
        stretch=float(np.max(np.abs(x - machine.rest_length))),
        effort=max(float(np.max(np.abs(f))) for f in efforts),
        slope=max(float(np.quantile(np.abs(np.diff(f)) * 1000.0, 0.999)) for f in efforts),
        duration=max(run.duration for run in runs),
        shortest=min(run.duration for run in runs),
    )


def _sign(rng: Rng) -> float:
    return 1.0 if rng.random() < 0.5 else -1.0


def _log(rng: Rng, low: float, high: float) -> float:
    return math.exp(rng.uniform(math.log(low), math.log(high)))


def _of(size: str, largest: float, **others: float) -> Sized:
    """Size in proportion to the strength."""
    return lambda strength: {size: largest * strength, **others}


def _limit(size: str, peak: float, lowest: float) -> Sized:
    """A limit that comes down from the peak of what it limits."""
    return lambda strength: {size: peak * (1.0 - (1.0 - lowest) * strength)}


def _end_stop(rng: Rng, m: Motion) -> Sized:
    side = _sign(rng)
    stiffness, damping = m.machine.stiffness * _log(rng, 3.0, 30.0), rng.uniform(0.05, 0.4)
    end = m.high if side > 0 else m.low

    def sized(strength: float) -> dict[str, float]:
        position = end + 0.02 * (end - m.centre) - strength * 0.6 * (end - m.centre)
        return {"stiffness": stiffness, "damping_ratio": damping, "position": position, "side": side}

    return sized


def _position_damping(rng: Rng, m: Motion) -> Sized:
    n = float(rng.choice([1.0, 2.0]))
    reference = m.centre + rng.uniform(-1.0, 1.0) * m.position
    sign = _sign(rng) if n == 1.0 else 1.0
    return _of("coefficient", sign * m.machine.damping / m.position**n, reference=reference, exponent=n)


def _disturbance(rng: Rng, m: Motion) -> Sized:
    frequency = m.pumping
    while abs(frequency / m.pumping - round(frequency / m.pumping)) < 0.05:
        frequency = m.natural / (2.0 * math.pi) * _log(rng, 0.5, 3.0)
    return _of("amplitude", 0.5 * m.unit, frequency=frequency, phase=rng.uniform(-math.pi, math.pi))


SIZES: dict[str, Callable[[Rng, Motion], Sized]] = {
    "command_lag": lambda rng, m: _of("time_constant", 0.5 / m.natural),
    "command_hold": lambda rng, m: _of("period", 1.5 / m.natural),
    "input_delay_drift": lambda rng, m: _of("rate", _sign(rng) * 0.05 / m.duration),
    "actuator_lag": lambda rng, m: _of("time_constant", 0.4 / m.natural),
    "actuator_saturation": lambda rng, m: _limit("limit", m.effort, 0.3),
    "actuator_rate_limit": lambda rng, m: _limit("rate", m.slope, 0.2),
    "actuator_deadband": lambda rng, m: _of("threshold", 0.6 * m.unit),
    "actuator_nonlinearity": lambda rng, m: _of("coefficient", _sign(rng) * 0.3 / m.effort**2),
    "actuator_fade": lambda rng, m: _of("rate", 0.5 / m.duration),
    "backlash": lambda rng, m: _of("width", m.unit),
    "coulomb_friction": lambda rng, m: _of("force", 0.4 * m.unit),
    "asymmetric_coulomb_friction": lambda rng, m: _of(
        "force", 0.4 * m.unit, asymmetry=_sign(rng) * rng.uniform(0.3, 0.8)
    ),
    "stribeck_friction": lambda rng, m: _of(
        "force", 0.3 * m.unit, static_ratio=rng.uniform(1.5, 3.0), stribeck_speed=m.velocity * rng.uniform(0.15, 0.5)
    ),
    "load_dependent_friction": lambda rng, m: _of("coefficient", 0.5),
    "elastoplastic_hysteresis": lambda rng, m: _of(
        "stiffness", m.machine.stiffness, yield_displacement=m.cycle * _log(rng, 0.1, 1.5)
    ),
    "viscous_damper": lambda rng, m: _of("damping", 2.0 * m.machine.damping),
    "flight_damping": lambda rng, m: _of("damping", 2.0 * m.machine.damping),
    "switching_threshold": lambda rng, m: _of("threshold", _sign(rng) * 1.5 * m.velocity),
    "position_dependent_damping": _position_damping,
    "quadratic_drag": lambda rng, m: _of("coefficient", 2.0 * m.machine.damping / m.velocity),
    "quadratic_stiffness": lambda rng, m: _of("coefficient", _sign(rng) * 0.4 * m.machine.stiffness / m.stretch),
    "cubic_stiffness": lambda rng, m: _of("coefficient", _sign(rng) * 0.4 * m.machine.stiffness / m.stretch**2),
    "quintic_stiffness": lambda rng, m: _of("coefficient", _sign(rng) * 0.4 * m.machine.stiffness / m.stretch**4),
    "bilinear_stiffness": lambda rng, m: _of(
        "change", _sign(rng) * 0.7 * m.machine.stiffness, kink=m.centre + rng.uniform(-1.0, 1.0) * m.position
    ),
    "freeplay": lambda rng, m: _of("gap", m.stretch),
    "viscoelastic_relaxation": lambda rng, m: _of(
        "stiffness", m.machine.stiffness, time_constant=_log(rng, 0.15, 3.0) / m.natural
    ),
    "stiffness_drift": lambda rng, m: _of("rate", _sign(rng) * 0.3 / m.duration),
    "stiffness_jump": lambda rng, m: _of("change", _sign(rng) * 0.3, time=rng.uniform(0.2, 0.8) * m.shortest),
    "ground_contact_loss": lambda rng, m: _of("loss", 1.0),
    "end_stop_contact": _end_stop,
    "position_ripple": lambda rng, m: _of(
        "amplitude", 0.5 * m.unit, wavelength=(m.high - m.low) / _log(rng, 1.5, 10.0),
        phase=rng.uniform(-math.pi, math.pi),
    ),
    "periodic_disturbance": _disturbance,
    "second_mode": lambda rng, m: _of(
        "mass", 0.3 * m.machine.mass, frequency=m.natural / (2.0 * math.pi) * _log(rng, 1.4, 4.0),
        damping_ratio=rng.uniform(0.03, 0.2),
    ),
    "sensor_drift": lambda rng, m: _of("rate", _sign(rng) * 3.0 * m.position / m.duration),
    "sensor_lag": lambda rng, m: _of("time_constant", 0.4 / m.natural),
    "sensor_nonlinearity": lambda rng, m: _of(
        "coefficient", _sign(rng) * 0.3 / (m.high - m.low), reference=m.centre + rng.uniform(-2.0, 2.0) * m.position
    ),
    "clock_skew": lambda rng, m: _of("skew", _sign(rng) * 0.05 / m.duration),
    "delay_drift": lambda rng, m: _of("rate", _sign(rng) * 0.05 / m.duration),
}  # fmt: skip

# Classes of one and the same model: a case draws one of them, and no record can tell which.
EQUIVALENT = (frozenset({"viscous_damper", "flight_damping"}), frozenset({"clock_skew", "delay_drift"}))
