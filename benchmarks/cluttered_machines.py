"""Simulated machines for the bench: one effect that the nominal model lacks, with three small ones beside it.

Every machine has its own few lines of code, integrated by a fourth-order Runge-Kutta scheme with a fixed step, without code of rhythmid's
simulator. Friction changes sign over 1 mm/s or 1 mrad/s; logs have jittered stamps and noise.
"""

import math
from collections.abc import Callable
from pathlib import Path

import numpy as np
from bench_case import COULOMB_FAMILY, LAGS, Array, Case, write_model, write_signals, write_table

STEP = 4e-4  # s; friction changes sign within TURN at up to 4000 1/s; at this step the scheme is stable up to 7000 1/s
TURN = 1e-3  # m/s or rad/s, range in which friction changes sign
POSITION_NOISE = 2e-5  # m or rad, standard deviation
JITTER = 0.05  # standard deviation of a stamp, in sample periods
RATE = 500.0  # Hz, of the logs

Slope = Callable[[float, list[float]], list[float]]
Wave = Callable[[float], float]


def run(slope: Slope, state: list[float], length: float) -> Array:
    """States [steps, states] every STEP from `state`, by the fourth-order Runge-Kutta scheme."""
    states = [state]
    for index in range(int(length / STEP)):
        t, x = index * STEP, states[-1]
        a = slope(t, x)
        b = slope(t + STEP / 2, [y + STEP / 2 * d for y, d in zip(x, a)])
        c = slope(t + STEP / 2, [y + STEP / 2 * d for y, d in zip(x, b)])
        d = slope(t + STEP, [y + STEP * s for y, s in zip(x, c)])
        states.append([y + STEP / 6 * (p + 2 * q + 2 * r + s) for y, p, q, r, s in zip(x, a, b, c, d)])
    return np.array(states)


def multisine(seed: int, amplitude: float, band: tuple[float, float], lines: int = 9) -> Wave:
    """A sum of sines [s] -> value whose standard deviation is `amplitude`, with lines spread over `band` [Hz]."""
    rng = np.random.default_rng(seed)
    waves = [(2 * math.pi * float(f), float(rng.uniform(0, 2 * math.pi))) for f in np.linspace(*band, lines)]
    scale = amplitude * math.sqrt(2 / lines)
    return lambda t: scale * sum(math.sin(w * t + p) for w, p in waves)


def log(
    path: Path, seed: int, channels: dict[str, Array], noise: dict[str, float], rate: float = RATE
) -> Path:
    """A table of `channels`, each given every STEP, at `rate` [Hz] with jittered stamps and `noise` (standard deviations)."""
    rng = np.random.default_rng(seed)
    grid = np.arange(len(next(iter(channels.values())))) * STEP
    time = np.arange(2, int(grid[-1] * rate) - 2) / rate
    time = time + rng.normal(0, JITTER / rate, len(time)).clip(-0.3 / rate, 0.3 / rate)
    columns = {"t": time}
    for name, value in channels.items():
        columns[name] = np.interp(time, grid, value) + rng.normal(0, noise.get(name, 0.0), len(time))
    return write_table(path, columns)


def sign(v: float) -> float:
    return math.tanh(v / TURN)


Simulated = Callable[[int], tuple[dict[str, Array], dict[str, float]]]  # seed -> channels, noise


def axis(seed: int, friction: float = 4.0, clutter: float = 1.0) -> tuple[dict[str, Array], dict[str, float]]:
    """An axis of 1.7 kg under proportional-derivative control, its motor force measured: Coulomb friction, and
    position ripple, quadratic drag and a cogging force with the travel as clutter."""
    reference = multisine(seed, 0.03, (0.2, 2.5))
    mass, damping = 1.7, 12.0

    def force(t: float, x: float, v: float) -> float:
        return 4000.0 * (reference(t) - x) - 60.0 * v

    def slope(t: float, s: list[float]) -> list[float]:
        x, v = s
        small = clutter * (
            0.15 * math.sin(2 * math.pi * x / 0.02) + 1.5 * abs(v) * v + 0.1 * math.cos(2 * math.pi * 7.3 * t)
        )
        return [v, (force(t, x, v) - damping * v - friction * sign(v) - small) / mass]

    s = run(slope, [reference(0), 0.0], 12.0)
    u = np.array([force(i * STEP, *state) for i, state in enumerate(s)])
    return {"force": u, "x": s[:, 0]}, {"force": 0.01 * float(np.std(u)), "x": POSITION_NOISE}


def quiet_axis(seed: int) -> tuple[dict[str, Array], dict[str, float]]:
    """The same axis with nothing missing, but 5 % of noise on the effort."""
    channels, noise = axis(seed, friction=0.0, clutter=0.0)
    return channels, {**noise, "force": 0.05 * float(np.std(channels["force"]))}


def arm(seed: int) -> tuple[dict[str, Array], dict[str, float]]:
    """A joint with a heavy link under control, its effort measured: Coulomb friction that differs by direction; a soft cable, drag
    and a motor's ripple as clutter."""
    reference = multisine(seed, 0.35, (0.1, 1.2))
    inertia, gravity, damping = 0.8, 14.0, 1.2

    def effort(t: float, q: float, v: float) -> float:
        return 900.0 * (reference(t) - q) - 45.0 * v + gravity * math.sin(q)

    def slope(t: float, s: list[float]) -> list[float]:
        q, v = s
        friction = 3.2 * sign(v) if v > 0 else 1.8 * sign(v)
        small = 0.4 * q + 0.15 * abs(v) * v + 0.1 * math.sin(20 * q)
        return [v, (effort(t, q, v) - gravity * math.sin(q) - damping * v - friction - small) / inertia]

    s = run(slope, [reference(0), 0.0], 12.0)
    u = np.array([effort(i * STEP, *state) for i, state in enumerate(s)])
    return {"effort": u, "q": s[:, 0]}, {"effort": 0.01 * float(np.std(u)), "q": POSITION_NOISE}


def pendulum(seed: int) -> tuple[dict[str, Array], dict[str, float]]:
    """A free pendulum from about 1.5 rad: Coulomb friction, with a little drag and a slight magnet at the bottom as clutter."""
    start = 1.5 - 0.05 * (seed % 3)

    def slope(t: float, s: list[float]) -> list[float]:
        q, v = s
        friction = 0.25 * sign(v) + 0.004 * abs(v) * v
        return [v, -19.6 * math.sin(q) - 0.02 * v - friction - 0.05 * q * math.exp(-((q / 0.2) ** 2))]

    s = run(slope, [start, 0.0], 18.0)
    return {"q": s[:, 0]}, {"q": 5e-4}


def shaken(seed: int) -> tuple[dict[str, Array], dict[str, float]]:
    """A mass on springs on a base that is displaced, rubbing on the room with dry friction; clutter: cubic spring, drag, ripple."""
    base = multisine(seed, 0.004, (1.0, 9.0))
    mass, stiffness, damping = 0.5, 900.0, 1.0

    def slope(t: float, s: list[float]) -> list[float]:
        x, v = s
        d = x - base(t)
        w = v - (base(t + 1e-5) - base(t - 1e-5)) / 2e-5
        small = 2e4 * d**3 + 0.05 * abs(v) * v
        return [v, (-stiffness * d - damping * w - 1.2 * sign(v) - small) / mass]

    s = run(slope, [0.0, 0.0], 12.0)
    b = np.array([base(i * STEP) for i in range(len(s))])
    return {"base": b, "x": s[:, 0]}, {"base": POSITION_NOISE / 4, "x": POSITION_NOISE / 4}


def air_track(seed: int) -> tuple[dict[str, Array], dict[str, float]]:
    """A glider between springs on an air track, decaying: quadratic drag, with faint Coulomb friction and a tilt as clutter."""
    start = 0.25 - 0.02 * (seed % 3)

    def slope(t: float, s: list[float]) -> list[float]:
        x, v = s
        return [v, -30.0 * x - 0.03 * v - 0.35 * abs(v) * v - 0.0015 * sign(v) - 0.002]

    s = run(slope, [start, 0.0], 25.0)
    return {"x": s[:, 0]}, {"x": 2e-4}


def servo(seed: int) -> tuple[dict[str, Array], dict[str, float]]:
    """A position servo of which reference and position alone are known: an actuator's lag of 12 ms; friction, ripple, drag as clutter."""
    reference = multisine(seed, 0.3, (0.2, 4.0))

    def slope(t: float, s: list[float]) -> list[float]:
        q, v, f = s
        wanted = 400.0 * (reference(t) - q) - 25.0 * v
        small = 0.6 * sign(v) + 0.3 * math.sin(12 * q) + 0.03 * abs(v) * v
        return [v, f - small, (wanted - f) / 0.012]

    s = run(slope, [reference(0), 0.0, 0.0], 12.0)
    r = np.array([reference(i * STEP) for i in range(len(s))])
    return {"reference": r, "q": s[:, 0]}, {"q": 1e-4}


def hopper(seed: int) -> tuple[dict[str, Array], dict[str, float]]:
    """A mass on a leg that never leaves the ground, driven by a force through a lag of 15 ms; clutter: drag, Coulomb friction, a hardening spring."""
    force = multisine(seed, 1.2, (0.5, 6.0))

    def slope(t: float, s: list[float]) -> list[float]:
        x, v, f = s
        small = 0.03 * sign(v) + 0.2 * abs(v) * v + 200.0 * x**3
        return [v, f - 200.0 * x - 2.0 * v - small, (force(t) - f) / 0.015]

    s = run(slope, [0.0, 0.0, 0.0], 20.0)
    u = np.array([force(i * STEP) for i in range(len(s))])
    return {"u": u, "x": s[:, 0]}, {"x": POSITION_NOISE}


AXIS = """
inertia: {mass: {value: 1.7, unit: kg, prior: {mean: 1.7, std: 0.2}}}
force:
  - viscous_damper: {damping: {value: 12.0, unit: N*s/m}}
"""
ARM = """
units: {force: N*m, position: rad}
inertia: {mass: {value: 0.8, unit: N*m*s^2/rad, prior: {mean: 0.8, std: 0.1}}}
force:
  - pendulum_gravity: {moment: {value: 14.0, unit: N*m, prior: {mean: 14.0, std: 1.5}}, reference: {value: 0.0, unit: rad, fixed: true}}
  - viscous_damper: {damping: {value: 1.0, unit: N*m*s/rad}}
"""
PENDULUM = """
units: {force: rad/s^2, position: rad}
inertia: {mass: {value: 1.0, fixed: true}}
force:
  - pendulum_gravity: {moment: {value: 19.0}, reference: {value: 0.0, unit: rad, fixed: true}}
  - viscous_damper: {damping: {value: 0.05}}
"""
SHAKEN = """
inertia: {mass: {value: 0.5, unit: kg, fixed: true}}
force:
  - linear_spring: {stiffness: {value: 850.0, unit: N/m}, rest_length: {value: 0.0, unit: m, fixed: true}}
  - viscous_damper: {damping: {value: 1.5, unit: N*s/m}}
"""
TRACK = """
units: {force: m/s^2, position: m}
inertia: {mass: {value: 1.0, fixed: true}}
force:
  - linear_spring: {stiffness: {value: 29.0}, rest_length: {value: 0.0, unit: m}}
  - viscous_damper: {damping: {value: 0.1}}
"""
SERVO = """
units: {force: rad/s^2, position: rad}
inertia: {mass: {value: 1.0, fixed: true}}
command:
  - position_control: {proportional: {value: 400.0, fixed: true}, derivative: {value: 24.0}}
"""
HOPPER = """
inertia: {mass: {value: 1.0, unit: kg, fixed: true}}
force:
  - linear_spring: {stiffness: {value: 190.0, unit: N/m}, rest_length: {value: 0.0, unit: m}}
  - viscous_damper: {damping: {value: 2.2, unit: N*s/m}}
"""
FORCE, ANGLE, NONE = "input: {column: force, hold: linear}", "output: {column: q, unit: rad}", "input: none"
TORQUE = "input: {column: effort, unit: N*m, hold: linear}"
SLOW = 100.0  # Hz, of what was filmed
MACHINES: tuple[tuple[str, str, Simulated, str, tuple[str, str], float, frozenset[str], dict[str, float]], ...] = (
    ("axis", "mass, damper", axis, AXIS, (FORCE, "output: {column: x}"), RATE, COULOMB_FAMILY, {"coulomb_friction.force": 4.0}),
    ("axis null", "mass, damper", quiet_axis, AXIS, (FORCE, "output: {column: x}"), RATE, frozenset(), {}),
    ("arm joint", "inertia, gravity, damper", arm, ARM, (TORQUE, ANGLE), RATE, COULOMB_FAMILY, {}),
    ("free pendulum", "gravity, damper", pendulum, PENDULUM, (NONE, ANGLE), SLOW, COULOMB_FAMILY, {"coulomb_friction.force": 0.25}),
    ("shaken mass", "mass, spring, damper", shaken, SHAKEN, ("input: {column: base, kind: base_displacement, hold: linear}", "output: {column: x}"),
     RATE, COULOMB_FAMILY, {"coulomb_friction.force": 1.2}),
    ("air track", "spring, damper", air_track, TRACK, (NONE, "output: {column: x}"), SLOW, frozenset({"quadratic_drag"}), {"quadratic_drag.coefficient": 0.35}),
    ("servo", "inertia, controller", servo, SERVO, ("input: {column: reference, unit: rad, kind: reference, hold: linear}", ANGLE), RATE, LAGS, {}),
    ("hopper", "mass, spring, damper", hopper, HOPPER, ("input: {column: u, hold: linear}", "output: {column: x}"), RATE, LAGS, {}),
)  # fmt: skip
SEEDS, HELD_OUT = (1, 2), 3  # of the records for the fit and of the held-out one


def cluttered_cases(folder: Path, wanted: Callable[[str], bool] = lambda _: True) -> list[Case]:
    """The simulated machines whose names are `wanted` as cases, their logs written to `folder`: two records for the fit and one
    held out."""
    cases: list[Case] = []
    for machine, nominal, simulated, text, channels, rate, first, truth in MACHINES:
        name = f"cluttered {machine}"
        if not wanted(name):
            continue
        stem = machine.replace(" ", "_")
        paths = []
        for seed in (*SEEDS, HELD_OUT):
            values, noise = simulated(seed)
            table = log(folder / f"{stem}{seed}.csv", seed, values, noise, rate)
            paths.append(write_signals(folder, f"{stem}{seed}", table, ["time: {column: t}", *channels]))
        model = write_model(folder, stem, text)
        cases.append(Case(name, nominal, tuple(paths[:-1]), (paths[-1],), model, first, truth))
    return cases
