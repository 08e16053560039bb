"""Synthetic twins of real machines' records: plainly written equations under scipy's adaptive integrator.

Nothing here comes from the package but the container of a record. Every twin is made with or without the effect that its
nominal model lacks, from a seed.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from synthetic import Array, integrate, moves, noisy, rounded, sampled, sign, tones

from rhythmid.record.record import Channel, Record


@dataclass(frozen=True)
class Twin:
    """Records of a machine, the nominal model of it (YAML), and what that model lacks: an element's name, "" for
    nothing, and its true parameters by name."""

    records: list[Record]
    nominal: str
    lacks: str
    truth: Mapping[str, float] = field(default_factory=dict)


def axis(
    friction: float = 3.0, seed: int = 0, count: int = 2, duration: float = 12.0, known: str = "effort"
) -> Twin:
    """Linear axis under PD position control, Coulomb friction [N] missing; encoder of 1 µm, records at 1 kHz.

    `known` is what was recorded beside the position: the motor's `effort`, of a controller at 1 kHz, or the `reference` of
    a known controller at 10 kHz.
    """
    rng = np.random.default_rng([1, seed])
    m, c, kp, kd, period = 2.0, 8.0, 2000.0, 60.0, 1e-3

    def rate(v: float, u: float) -> float:
        return (u - c * v - friction * np.tanh(v / 2e-4)) / m

    def record(index: int) -> Record:
        way = moves(rng, 0.08, duration) if index % 2 == 0 else tones(rng, 0.03, 0.2, 4.0)
        time, sub = np.arange(0.0, duration, period), 10
        h = period / sub
        position, effort = np.zeros(len(time)), np.zeros(len(time))
        x, v, u = way(0.0), 0.0, 0.0
        for k in range(len(time)):
            position[k] = x
            for j in range(sub):  # Runge-Kutta of fourth order, the controller's force held
                if j == 0 or known == "reference":
                    u = kp * (way(time[k] + j * h) - x) - kd * v
                if j == 0:
                    effort[k] = u
                a1 = rate(v, u)
                a2 = rate(v + 0.5 * h * a1, u)
                a3 = rate(v + 0.5 * h * a2, u)
                a4 = rate(v + h * a3, u)
                x += h * v + h * h * (a1 + a2 + a3) / 6.0
                v += h * (a1 + 2.0 * a2 + 2.0 * a3 + a4) / 6.0
        measured = Channel(time, rounded(noisy(rng, position, 1e-6), 1e-6), "m")
        if known == "effort":
            return Record(f"axis {index}", measured, Channel(time, effort, "N"))
        reference = Channel(time, sampled(way, time), "m")
        return Record(f"axis {index}", measured, reference, hold="linear", input_kind="reference")

    loop = (
        ""
        if known == "effort"
        else (
            "command: [{position_control: {proportional: {value: 2000.0, fixed: true}, derivative: {value: 60.0, fixed: true}}}]\n"
        )
    )
    nominal = (
        "inertia: {mass: {value: 1.7, unit: kg}}\n"
        + loop
        + "force: [{viscous_damper: {damping: {value: 12.0, unit: N*s/m}}}]\n"
    )
    return Twin(
        [record(i) for i in range(count)],
        nominal,
        "coulomb_friction" if friction else "",
        {"force": friction},
    )


def joint(
    friction: float = 0.4, seed: int = 0, count: int = 2, duration: float = 15.0, weight: float = 0.0
) -> Twin:
    """Robot joint driven by a current [A] (500 Hz), of which only the velocity is measured; Coulomb friction [N m] missing,
    or the `weight` [N m] of its link."""
    rng = np.random.default_rng([2, seed])
    inertia, c, constant, period = 0.05, 0.08, 0.6, 2e-3

    def record(index: int) -> Record:
        current = tones(rng, 1.2 if index else 2.5, 0.4, 5.0)
        time = np.arange(0.0, duration, period)
        held = sampled(current, time)
        states, h = np.zeros((len(time), 2)), period / 10
        x, v = 0.4, 0.0

        def rate(x: float, v: float, i: float) -> float:
            return (constant * i - c * v - friction * sign(v, 5e-3) - weight * np.sin(x)) / inertia

        for k in range(len(time)):
            states[k] = x, v
            for _ in range(10):
                a1 = rate(x, v, held[k])
                a2 = rate(x + 0.5 * h * v, v + 0.5 * h * a1, held[k])
                a3 = rate(x + 0.5 * h * v + 0.25 * h * h * a1, v + 0.5 * h * a2, held[k])
                a4 = rate(x + h * v + 0.5 * h * h * a2, v + h * a3, held[k])
                x += h * v + h * h * (a1 + a2 + a3) / 6.0
                v += h * (a1 + 2.0 * a2 + 2.0 * a3 + a4) / 6.0
        velocity = Channel(time, noisy(rng, states[:, 1], 0.02), "rad/s")
        return Record(f"joint {index}", velocity, Channel(time, held, "A"), output_kind="velocity")

    records = [record(index) for index in range(count)]
    nominal = """
units: {force: A, position: rad}
inertia: {mass: {value: 0.07}}
force: [{viscous_damper: {damping: {value: 0.1}}}]
"""
    if weight:
        return Twin(records, nominal, "pendulum_gravity", {"moment": weight / constant})
    truth = {"force": friction / constant}
    return Twin(records, nominal, "coulomb_friction" if friction else "", truth)


def pendulum(
    large: bool = True, seed: int = 0, count: int = 2, duration: float = 20.0, driven: bool = True
) -> Twin:
    """Pendulum at 200 Hz with large swings (or a linear torsional spring), a linear nominal model."""
    rng = np.random.default_rng([3, seed])
    inertia, c, moment, period = 0.02, 0.02, 0.9, 5e-3

    def record(index: int) -> Record:
        torque = tones(rng, 0.15 if driven else 0.0, 0.3, 2.0)
        time = np.arange(0.0, duration, period)
        start = [1.8, 0.0] if index == 0 else [-0.5, 2.0]
        states = integrate(
            lambda t, s: [s[1], (torque(t) - c * s[1] - moment * (np.sin(s[0]) if large else s[0])) / inertia],
            start, time, 0.02,
        )  # fmt: skip
        angle = rounded(noisy(rng, states[:, 0], 5e-4), 2.0 * np.pi / 8192)
        return (
            Record(
                f"pendulum {index}", Channel(time, angle, "rad"),
                Channel(time, sampled(torque, time), "N*m") if driven else None, hold="band_limited",
            )
        )  # fmt: skip

    records = [record(index) for index in range(count)]
    nominal = """
inertia: {mass: {value: 0.02, unit: kg*m^2, fixed: true}}
force:
  - linear_spring: {stiffness: {value: 0.7, unit: N*m/rad}, rest_length: {value: 0.0, unit: rad}}
  - viscous_damper: {damping: {value: 0.002, unit: N*m*s/rad}}
"""
    return Twin(records, nominal, "pendulum_gravity" if large else "", {"moment": moment})


def rig(
    cubic: float = 4e7, seed: int = 0, count: int = 2, duration: float = 12.0, kind: str = "base_displacement"
) -> Twin:
    """Mass on a shaken base at 500 Hz; the input is the base's displacement or its acceleration, the cubic is missing.

    The output is the mass's position, absolute where the base's displacement is known, else relative to the base.
    """
    rng = np.random.default_rng([4, seed])
    m, c, k, period = 0.5, 1.5, 1800.0, 2e-3

    def record(index: int) -> Record:
        frequency = np.geomspace(2.0, 20.0, 15) * rng.uniform(0.95, 1.05, 15)
        phase = rng.uniform(0.0, 2.0 * np.pi, 15)
        size = (0.6e-3 if index else 0.3e-3) * (6.0 / frequency)
        w = 2.0 * np.pi * frequency
        time = np.arange(0.0, duration, period)

        def base(t: float, order: int) -> float:
            return float((size * w**order * np.sin(w * t + phase + 0.5 * np.pi * order)).sum())

        def rates(t: float, s: Array) -> list[float]:
            e, de = s[0] - base(t, 0), s[1] - base(t, 1)
            return [s[1], (-k * e - c * de - cubic * e**3) / m]

        states = integrate(rates, [base(0.0, 0), base(0.0, 1)], time, 4e-3)
        displacement = np.array([base(t, 0) for t in time])
        if kind == "base_displacement":
            output, given, unit = states[:, 0], noisy(rng, displacement, 1e-7), "m"
        else:
            output, given, unit = (
                states[:, 0] - displacement,
                noisy(rng, np.array([base(t, 2) for t in time]), 2e-3),
                "m/s^2",
            )
        return (
            Record(
                f"rig {index}", Channel(time, noisy(rng, output, 3e-6), "m"), Channel(time, given, unit),
                hold="band_limited", input_kind=kind,
            )
        )  # fmt: skip

    records = [record(index) for index in range(count)]
    nominal = """
inertia: {mass: {value: 0.5, unit: kg, fixed: true}}
force:
  - linear_spring: {stiffness: {value: 1500.0, unit: N/m}, rest_length: {value: 0.0, unit: m}}
  - viscous_damper: {damping: {value: 2.0, unit: N*s/m}}
"""
    return Twin(records, nominal, "cubic_stiffness" if cubic else "", {"coefficient": cubic})


def servo(effect: str = "actuator_saturation", seed: int = 0, count: int = 2, duration: float = 12.0) -> Twin:
    """Position servo at 100 Hz of which only command and motion (degrees) are known.

    Effects: `actuator_saturation` (of its torque), `reference_rate_limit` (of its set point), `actuator_deadband`
    (it does not push when the error is small), `coulomb_friction`, or none ("").
    """
    rng = np.random.default_rng([5, seed])
    omega, zeta, period = 25.0, 0.7, 1e-2
    top, slew, dead, friction = 4000.0, 120.0, 300.0, 400.0  # deg/s^2, deg/s, deg/s^2, deg/s^2

    def record(index: int) -> Record:
        way = moves(rng, 40.0, duration, 0.4) if index % 2 == 0 else tones(rng, 15.0, 0.2, 3.0)
        time = np.arange(0.0, duration, period)
        command = sampled(way, time)
        if index % 2 == 0:
            command = rounded(command, 10.0)  # steps, as a program sends them

        def held(t: float) -> float:
            return float(command[min(int(t / period + 1e-9), len(command) - 1)])

        def rates(t: float, s: Array) -> list[float]:
            point = s[2] if effect == "reference_rate_limit" else held(t)
            push = omega**2 * (point - s[0]) - 2.0 * zeta * omega * s[1]
            if effect == "actuator_saturation":
                push = float(np.clip(push, -top, top))
            elif effect == "actuator_deadband":
                push = float(np.sign(push) * max(abs(push) - dead, 0.0))
            elif effect == "coulomb_friction":
                push -= friction * sign(s[1], 0.5)
            return [s[1], push, float(np.clip((held(t) - s[2]) / 1e-3, -slew, slew))]

        states = integrate(rates, [command[0], 0.0, command[0]], time, 2e-3)
        angle = noisy(rng, states[:, 0], 0.05)
        return Record(
            f"servo {index}",
            Channel(time, angle, "deg"),
            Channel(time, command, "deg"),
            input_kind="reference",
        )

    records = [record(index) for index in range(count)]
    nominal = """
units: {force: deg/s^2, position: deg}
inertia: {mass: {value: 1.0, fixed: true}}
command:
  - position_control: {proportional: {value: 400.0}, derivative: {value: 25.0}}
"""
    truth = {
        "actuator_saturation": {"limit": top}, "reference_rate_limit": {"rate": slew}, "actuator_deadband": {"width": dead},
        "coulomb_friction": {"force": friction},
    }  # fmt: skip
    return Twin(records, nominal, effect, truth.get(effect, {}))


def decay(effect: str = "quadratic_drag", seed: int = 0, count: int = 3, duration: float = 10.0) -> Twin:
    """Free decays at 250 Hz after being let go; no input at all. Effects: `quadratic_drag`, `coulomb_friction`, ""."""
    rng = np.random.default_rng([6, seed])
    m, c, k, drag, friction, period = 1.2, 0.5, 180.0, 0.8, 0.15, 4e-3

    def record(index: int) -> Record:
        time = np.arange(0.0, duration, period)

        def rates(t: float, s: Array) -> list[float]:
            force = -k * (s[0] - 0.02) - c * s[1]
            if effect == "quadratic_drag":
                force -= drag * s[1] * abs(s[1])
            elif effect == "coulomb_friction":
                force -= friction * sign(s[1], 1e-4)
            return [s[1], force / m]

        states = integrate(rates, [0.02 + (0.1, -0.06, 0.03)[index % 3], 0.0], time, 4e-3)
        return Record(f"decay {index}", Channel(time, noisy(rng, states[:, 0], 5e-5), "m"))

    records = [record(index) for index in range(count)]
    nominal = """
inertia: {mass: {value: 1.2, unit: kg, fixed: true}}
force:
  - linear_spring: {stiffness: {value: 150.0, unit: N/m}, rest_length: {value: 0.0, unit: m}}
  - viscous_damper: {damping: {value: 0.8, unit: N*s/m}}
"""
    truth = {"quadratic_drag": {"coefficient": drag}, "coulomb_friction": {"force": friction}}
    return Twin(records, nominal, effect, truth.get(effect, {}))


def camera(effect: str = "coulomb_friction", seed: int = 0, count: int = 3, duration: float = 20.0) -> Twin:
    """A swing filmed at 30 Hz, position in pixels, no input; Coulomb friction missing (or nothing, "")."""
    rng = np.random.default_rng([7, seed])
    omega, zeta, friction, period = 2.0 * np.pi * 1.1, 0.01, 130.0, 1.0 / 30.0

    def record(index: int) -> Record:
        time = np.arange(0.0, duration, period)
        rub = friction if effect else 0.0
        states = integrate(
            lambda t, s: [s[1], -(omega**2) * (s[0] - 640.0) - 2.0 * zeta * omega * s[1] - rub * sign(s[1], 1.0)],
            [640.0 + (400.0, -250.0, 120.0)[index % 3], 0.0], time, 0.01,
        )  # fmt: skip
        return Record(f"film {index}", Channel(time, noisy(rng, states[:, 0], 0.5), "px"))

    records = [record(index) for index in range(count)]
    nominal = """
units: {force: px/s^2, position: px}
inertia: {mass: {value: 1.0, fixed: true}}
force:
  - linear_spring: {stiffness: {value: 40.0}, rest_length: {value: 600.0}}
  - viscous_damper: {damping: {value: 0.3}}
"""
    return Twin(records, nominal, effect, {"force": friction})


def circuit(cubic: float = 0.8, seed: int = 0, count: int = 2, duration: float = 1.0) -> Twin:
    """An electronic oscillator (300 Hz) sampled at 10 kHz, volts in and out; the cubic is missing."""
    rng = np.random.default_rng([8, seed])
    omega, zeta, period = 2.0 * np.pi * 300.0, 0.04, 1e-4

    def record(index: int) -> Record:
        drive = tones(rng, 0.1 if index else 0.2, 20.0, 900.0, 30)
        time = np.arange(0.0, duration, period)
        states = integrate(
            lambda t, s: [s[1], omega**2 * (drive(t) - s[0] - cubic * s[0] ** 3) - 2.0 * zeta * omega * s[1]],
            [0.0, 0.0], time, 2e-4,
        )  # fmt: skip
        return (
            Record(
                f"circuit {index}", Channel(time, noisy(rng, states[:, 0], 5e-4), "V"),
                Channel(time, sampled(drive, time), "V"), hold="band_limited",
            )
        )  # fmt: skip

    records = [record(index) for index in range(count)]
    nominal = """
units: {force: V, position: V}
inertia: {mass: {value: 2.5e-7}}
force:
  - linear_spring: {stiffness: {value: 0.9}, rest_length: {value: 0.0, fixed: true}}
  - viscous_damper: {damping: {value: 5.0e-5}}
"""
    return Twin(records, nominal, "cubic_stiffness" if cubic else "", {"coefficient": cubic})
