"""A motor with a load, driven by a known current; only the speed is measured. Torques are in amperes."""

import math
from collections.abc import Sequence
from dataclasses import replace

from rhythmid.proof.machine import Effect, Machine
from rhythmid.proof.machines.rig import LAGS, Design, Rig, Rng, log_uniform
from rhythmid.proof.protocol import Run, draw_sweep, draw_tones

RATES = (200, 500, 1000)  # [Hz]
EFFECTS = (
    "coulomb_friction", "asymmetric_coulomb_friction", "stribeck_friction", "load_dependent_friction",
    "quadratic_drag", "pendulum_gravity", "constant_force", "actuator_deadband", "actuator_saturation",
    "actuator_nonlinearity", "torque_speed_limit", "actuator_lag", "second_mode",
)  # fmt: skip


def draw(rng: Rng, conceals: Sequence[str]) -> Rig:
    """Inertia of 0.02 to 0.5 A s²/rad, time constant of 0.2 to 1 s, speeds of some rad/s."""
    inertia = log_uniform(rng, 0.02, 0.5)
    damping = inertia / rng.uniform(0.2, 1.0)
    rate = int(rng.choice(RATES))
    speed = rng.uniform(2.0, 6.0)
    size = inertia * speed * 2.0 * math.pi
    lacks = None
    if "pendulum_gravity" in conceals:
        lacks = Effect("pendulum_gravity", {"moment": inertia * rng.uniform(2.0, 5.0) ** 2, "reference": 0.0})
    believed = Machine(inertia, 0.0, damping, 0.0, 0.0, return_damping=damping, sliding=1e-3 * speed)
    machine = replace(believed, moment=lacks.parameters["moment"]) if lacks else believed
    start = (0.1, 0.0) if lacks else (0.0, 0.0)

    def tones(name: str, scale: float) -> Run:
        return draw_tones(rng, name, scale * size, 0.4, 5.0, float(rng.integers(10, 20)), rate, start=start)

    runs = [tones("small", rng.uniform(0.4, 0.6)), tones("large", 1.0)]
    if rng.random() < 0.5:
        runs.append(draw_sweep(rng, "sweep", size, 0.3, 3.0, 12.0, rate, start))
    unseen = (tones("unseen_large", 0.9), tones("unseen_small", 0.5))
    return Rig(
        machine,
        believed,
        tuple(runs),
        unseen,
        speed,
        "command",
        velocity=True,
        lacks=lacks,
        units=("A", "rad"),
    )


DESIGN = Design(
    "motor",
    EFFECTS,
    draw,
    {"inertia.mass": "mass", "viscous_damper.damping": "damping"},
    (0.003, 0.02),
    alike=LAGS,
)
