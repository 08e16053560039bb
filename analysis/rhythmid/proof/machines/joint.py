"""A joint with a heavy link under a sampled position controller; the torque of its motor is recorded."""

import math
from collections.abc import Sequence
from dataclasses import replace

from rhythmid.proof.machine import Effect, Machine
from rhythmid.proof.machines.rig import Design, Rig, Rng, log_uniform
from rhythmid.proof.protocol import Run, draw_moves, draw_tones, from_reference

RATES = (200, 500, 1000)  # [Hz]
EFFECTS = (
    "pendulum_gravity", "coulomb_friction", "asymmetric_coulomb_friction", "stribeck_friction",
    "load_dependent_friction", "transmitted_load_friction", "quadratic_drag", "position_ripple",
    "actuator_deadband", "actuator_nonlinearity", "backlash", "second_mode",
)  # fmt: skip


def draw(rng: Rng, conceals: Sequence[str]) -> Rig:
    """A joint of 0.02 to 2 kg m² whose link would swing freely at 0.3 to 1 Hz; at the angle 0 it hangs down."""
    inertia = log_uniform(rng, 0.02, 2.0)
    rate = int(rng.choice(RATES))
    crossover = 2.0 * math.pi * rng.uniform(3.0, 8.0)
    damping = inertia * log_uniform(rng, 0.5, 4.0)
    moment = inertia * (2.0 * math.pi * rng.uniform(0.3, 1.0)) ** 2
    machine = Machine(
        inertia, 0.0, damping, 0.0, 0.0, return_damping=damping, moment=moment, proportional=inertia * crossover**2,
        derivative=2.0 * rng.uniform(0.6, 1.0) * inertia * crossover, sliding=1e-3, mode="sampled_position",
    )  # fmt: skip
    travel, centre = rng.uniform(0.5, 1.3), rng.uniform(-0.8, 0.8)

    def moves(name: str) -> Run:
        return draw_moves(
            rng, name, (centre - travel, centre + travel), float(rng.integers(8, 16)), rate, 0.5, 1.8
        )

    def tones(name: str) -> Run:
        duration = float(rng.integers(8, 16))
        return from_reference(draw_tones(rng, name, 0.5 * travel, 0.15, 2.5, duration, rate, falls=1.0))

    runs = [moves("moves"), tones("tones"), moves("moves_again")][: int(rng.integers(2, 4))]
    lacks = None
    if "pendulum_gravity" in conceals:
        lacks = Effect("pendulum_gravity", {"moment": moment, "reference": 0.0})
    return Rig(
        machine, replace(machine, moment=0.0) if lacks else machine, tuple(runs),
        (moves("unseen_moves"), tones("unseen_tones")), travel, "effort",
        effort_noise=log_uniform(rng, 0.003, 0.02), lacks=lacks, units=("N*m", "rad"),
    )  # fmt: skip


DESIGN = Design(
    "joint", EFFECTS, draw,
    {"inertia.mass": "mass", "viscous_damper.damping": "damping", "pendulum_gravity.moment": "moment"},
    (1e-5, 1e-4), by_effort=True,
)  # fmt: skip
