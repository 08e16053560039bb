"""Sizes and other parameters of each concealed effect, drawn at random within physical limits.

An effect's `strength` runs from 0 (absent) to 1 (as large as on any machine). It is chosen later by the mismatch that it causes.
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
    """Scales of the machine's motion in the experiments without the effect, for the sizes of effects."""

    machine: Machine
    stiffness: float  # [N/m] of the spring; without a spring, ratio of the units of force and position
    damping: float  # [N s/m] of the damper
    unit: float  # amplitude of the forcing [N], or rms of the driving force
    natural: float  # natural angular frequency [rad/s]
    pumping: float  # [Hz], 0 without forcing
    position: float  # standard deviation [m] over all records
    velocity: float  # [m/s]
    cycle: float  # amplitude of the limit cycle [m]
    low: float  # [m] limits of the motion, without a thousandth of the time
    high: float
    centre: float
    stretch: float  # largest |x - rest length| [m]
    effort: float  # largest |driving force| [N]
    slope: float  # largest rate of the driving force [N/s]
    reference_rate: float  # largest rate of a controller's reference [m/s]
    duration: float  # [s] longest record
    shortest: float


def motion_of(machine: Machine, forcing: Forcing, runs: tuple[Run, ...], seen: list[Observation]) -> Motion:
    """Scales of the motion in the records `seen`, which resulted from `runs`."""
    x = np.concatenate([one.position for one in seen])
    v = np.concatenate([one.velocity for one in seen])
    if machine.mode == "base":  # effects in the leg depend on the motion relative to the base
        x = x - np.concatenate([run.command for run in runs])
        v = v - np.concatenate([run.slopes for run in runs])
    efforts = [drive_of(machine, forcing, run, one) for run, one in zip(runs, seen)]
    rates = [run.rate for run in runs]
    cycle = next((one for run, one in zip(runs, seen) if forcing.amplitude and run.shape == "silence"), None)
    low, high = np.quantile(x, [0.001, 0.999])
    position, velocity = float(np.std(x)), float(np.std(v))
    unit = forcing.amplitude or float(np.sqrt(np.mean(np.concatenate(efforts) ** 2)))
    stiffness = machine.stiffness or unit / position
    references = [run.command for run in runs] if machine.mode == "continuous" else [np.zeros(2)]
    return Motion(
        machine=machine,
        stiffness=stiffness,
        damping=machine.damping or 0.2 * unit / velocity,
        unit=unit,
        natural=math.sqrt(stiffness / machine.mass),
        pumping=forcing.frequency if forcing.amplitude else 0.0,
        position=position,
        velocity=velocity,
        cycle=float(np.std(cycle.position if cycle else x)) * math.sqrt(2.0),
        low=float(low),
        high=float(high),
        centre=float(np.mean(x)),
        stretch=float(np.max(np.abs(x - machine.rest_length))),
        effort=max(float(np.max(np.abs(f))) for f in efforts),
        slope=max(float(np.quantile(np.abs(np.diff(f)) * rate, 0.999)) for f, rate in zip(efforts, rates)),
        reference_rate=max(
            float(np.quantile(np.abs(np.diff(r)) * rate, 0.999)) for r, rate in zip(references, rates)
        ),
        duration=max(run.duration for run in runs),
        shortest=min(run.duration for run in runs),
    )


def drive_of(machine: Machine, forcing: Forcing, run: Run, seen: Observation) -> Array:
    """The force [N] that drives the machine in a record.

    Command and forcing, or a controller's output; where nothing drives it, the inertial force of the moving mass.
    """
    if machine.mode in ("sampled_position", "sampled_velocity"):
        return seen.effort
    if machine.mode == "continuous":
        return machine.proportional * (run.command - seen.position) - machine.derivative * seen.velocity
    if machine.mode == "base" or not (forcing.amplitude or np.any(run.command)):
        return machine.mass * seen.acceleration
    return forcing.amplitude * run.forcing * np.cos(2.0 * np.pi * forcing.frequency * run.time) + run.command


def _sign(rng: Rng) -> float:
    return 1.0 if rng.random() < 0.5 else -1.0


def _log(rng: Rng, low: float, high: float) -> float:
    return math.exp(rng.uniform(math.log(low), math.log(high)))


def _of(size: str, largest: float, **others: float) -> Sized:
    """Parameters with the size proportional to the strength."""
    return lambda strength: {size: largest * strength, **others}


def _limit(size: str, peak: float, lowest: float) -> Sized:
    """Parameters of a limit that decreases from the peak of the limited signal with the strength."""
    return lambda strength: {size: peak * (1.0 - (1.0 - lowest) * strength)}


def _torque_speed_limit(rng: Rng, m: Motion) -> Sized:
    slope = m.effort / m.velocity * _log(rng, 0.3, 3.0)

    def sized(strength: float) -> dict[str, float]:
        # from a limit that passes the largest force at three times the usual speed, to one that passes half of it at standstill
        fastest, slowest = 3.0 * m.velocity + m.effort / slope, 0.5 * m.effort / slope
        return {"speed": fastest + (slowest - fastest) * strength, "slope": slope}

    return sized


def _end_stop(rng: Rng, m: Motion) -> Sized:
    side = _sign(rng)
    stiffness, damping = m.stiffness * _log(rng, 3.0, 30.0), rng.uniform(0.05, 0.4)
    end = m.high if side > 0 else m.low

    def sized(strength: float) -> dict[str, float]:
        position = end + 0.02 * (end - m.centre) - strength * 0.6 * (end - m.centre)
        return {"stiffness": stiffness, "damping_ratio": damping, "position": position, "side": side}

    return sized


def _position_damping(rng: Rng, m: Motion) -> Sized:
    n = float(rng.choice([1.0, 2.0]))
    reference = m.centre + rng.uniform(-1.0, 1.0) * m.position
    sign = _sign(rng) if n == 1.0 else 1.0
    return _of("coefficient", sign * m.damping / m.position**n, reference=reference, exponent=n)


def _disturbance(rng: Rng, m: Motion) -> Sized:
    def in_step(frequency: float) -> bool:
        return m.pumping > 0.0 and abs(frequency / m.pumping - round(frequency / m.pumping)) < 0.05

    frequency = m.pumping
    while frequency == 0.0 or in_step(frequency):
        frequency = m.natural / (2.0 * math.pi) * _log(rng, 0.5, 3.0)
    return _of("amplitude", 0.5 * m.unit, frequency=frequency, phase=rng.uniform(-math.pi, math.pi))


SIZES: dict[str, Callable[[Rng, Motion], Sized]] = {
    "command_lag": lambda rng, m: _of("time_constant", 0.5 / m.natural),
    "command_hold": lambda rng, m: _of("period", 1.5 / m.natural),
    "input_delay_drift": lambda rng, m: _of("rate", _sign(rng) * 0.05 / m.duration),
    "reference_rate_limit": lambda rng, m: _limit("rate", m.reference_rate, 0.1),
    "actuator_lag": lambda rng, m: _of("time_constant", 0.4 / m.natural),
    "actuator_saturation": lambda rng, m: _limit("limit", m.effort, 0.3),
    "torque_speed_limit": _torque_speed_limit,
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
    "transmitted_load_friction": lambda rng, m: _of("coefficient", 0.5, external_ratio=rng.uniform(0.3, 1.5)),
    "bouc_wen_hysteresis": lambda rng, m: _of(
        "stiffness", m.stiffness, yield_displacement=m.cycle * _log(rng, 0.1, 1.5), shape=0.5
    ),
    "elastoplastic_hysteresis": lambda rng, m: _of(
        "stiffness", m.stiffness, yield_displacement=m.cycle * _log(rng, 0.1, 1.5)
    ),
    "viscous_damper": lambda rng, m: _of("damping", 2.0 * m.damping),
    "flight_damping": lambda rng, m: _of("damping", 2.0 * m.damping),
    "switching_threshold": lambda rng, m: _of("threshold", _sign(rng) * 1.5 * m.velocity),
    "position_dependent_damping": _position_damping,
    "constant_force": lambda rng, m: _of("force", _sign(rng) * 0.5 * m.unit),
    "quadratic_drag": lambda rng, m: _of("coefficient", 2.0 * m.damping / m.velocity),
    "quadratic_damping": lambda rng, m: _of("coefficient", 2.0 * m.damping / m.velocity),
    "quadratic_stiffness": lambda rng, m: _of("coefficient", _sign(rng) * 0.4 * m.stiffness / m.stretch),
    "cubic_stiffness": lambda rng, m: _of("coefficient", _sign(rng) * 0.4 * m.stiffness / m.stretch**2),
    "quintic_stiffness": lambda rng, m: _of("coefficient", _sign(rng) * 0.4 * m.stiffness / m.stretch**4),
    "bilinear_stiffness": lambda rng, m: _of(
        "change", _sign(rng) * 0.7 * m.stiffness, kink=m.centre + rng.uniform(-1.0, 1.0) * m.position
    ),
    "freeplay": lambda rng, m: _of("gap", m.stretch),
    "viscoelastic_relaxation": lambda rng, m: _of(
        "stiffness", m.stiffness, time_constant=_log(rng, 0.15, 3.0) / m.natural
    ),
    "stiffness_drift": lambda rng, m: _of("rate", _sign(rng) * 0.3 / m.duration),
    "stiffness_jump": lambda rng, m: _of("change", _sign(rng) * 0.3, time=rng.uniform(0.2, 0.8) * m.shortest),
    "ground_contact_loss": lambda rng, m: _of("loss", 1.0),
    "end_stop_contact": _end_stop,
    "travel_stop": _end_stop,
    "position_ripple": lambda rng, m: _of(
        "amplitude", 0.5 * m.unit, wavelength=(m.high - m.low) / _log(rng, 2.2, 10.0),
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
    # outside the catalogue
    "two_harmonic_cogging": lambda rng, m: _of(
        "amplitude", 0.5 * m.unit, wavelength=(m.high - m.low) / _log(rng, 1.5, 8.0), phase=rng.uniform(-math.pi, math.pi),
        second=rng.uniform(0.4, 1.0), second_phase=rng.uniform(-math.pi, math.pi),
    ),
    "magnet": lambda rng, m: _of(
        "force", m.unit, place=m.centre + rng.uniform(-1.0, 1.0) * m.position,
        width=(m.high - m.low) * rng.uniform(0.03, 0.1),
    ),
    "relaxing_friction": lambda rng, m: _of(
        "force", 0.4 * m.unit, distance=m.position * _log(rng, 0.3, 3.0), ageing=_log(rng, 0.3, 3.0)
    ),
    "three_halves_drag": lambda rng, m: _of("coefficient", 2.0 * m.damping / math.sqrt(m.velocity)),
}  # fmt: skip

# Classes of observationally equivalent effects: a case draws one of them, and no record can separate them.
EQUIVALENT = (frozenset({"viscous_damper", "flight_damping"}), frozenset({"clock_skew", "delay_drift"}))
