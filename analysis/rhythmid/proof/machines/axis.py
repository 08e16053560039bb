"""A linear axis under a sampled position or velocity controller; the force of its motor is recorded."""

import math
from collections.abc import Sequence

from rhythmid.proof.machine import Machine
from rhythmid.proof.machines.rig import Design, Rig, Rng, log_uniform
from rhythmid.proof.protocol import Run, draw_moves, draw_sweep, draw_tones, from_reference

RATES = (500, 1000, 2000)  # [Hz]
EFFECTS = (
    "coulomb_friction", "asymmetric_coulomb_friction", "stribeck_friction", "load_dependent_friction",
    "quadratic_drag", "constant_force", "bouc_wen_hysteresis", "position_ripple", "position_dependent_damping",
    "actuator_deadband", "actuator_nonlinearity", "actuator_lag", "backlash", "second_mode", "periodic_disturbance",
)  # fmt: skip


def draw(rng: Rng, conceals: Sequence[str]) -> Rig:
    """An axis of 1 to 20 kg and 20 to 150 mm of travel."""
    mass, travel = log_uniform(rng, 1.0, 20.0), log_uniform(rng, 0.02, 0.15)
    crossover = 2.0 * math.pi * rng.uniform(5.0, 15.0)
    rate = int(rng.choice(RATES))
    by_speed = rng.random() < 0.4
    gains = (mass * crossover, 0.0, 0.25 * mass * crossover**2) if by_speed else (
        mass * crossover**2, 2.0 * rng.uniform(0.6, 1.0) * mass * crossover, 0.0
    )  # fmt: skip
    damping = mass * log_uniform(rng, 0.8, 6.0)
    machine = Machine(
        mass, 0.0, damping, 0.0, 0.0, return_damping=damping, proportional=gains[0], derivative=gains[1],
        integral=gains[2], sliding=1e-3 * travel, mode="sampled_velocity" if by_speed else "sampled_position",
    )  # fmt: skip

    def moves(name: str) -> Run:
        return draw_moves(
            rng, name, (-travel, travel), float(rng.integers(8, 14)), rate, 0.3, 1.2, speeds=by_speed
        )

    def tones(name: str) -> Run:
        low, high = 0.3, 4.0
        size = 0.4 * travel * (2.0 * math.pi * 1.0 if by_speed else 1.0)
        falls = 0.0 if by_speed else 1.0
        run = draw_tones(rng, name, size, low, high, float(rng.integers(8, 14)), rate, falls=falls)
        return run if by_speed else from_reference(run)

    def sweep(name: str) -> Run:
        size = travel * rng.uniform(0.1, 0.4) * (2.0 * math.pi * 0.6 if by_speed else 1.0)
        return draw_sweep(rng, name, size, 0.2, 3.0, float(rng.integers(8, 14)), rate)

    runs = [moves("moves"), tones("tones")]
    more = [lambda: sweep("sweep"), lambda: moves("moves_again")]
    runs += [more[index]() for index in rng.permutation(2)[: rng.integers(0, 3)]]
    return Rig(
        machine, machine, tuple(runs), (moves("unseen_moves"), tones("unseen_tones")), travel, "effort",
        effort_noise=log_uniform(rng, 0.003, 0.02),
    )  # fmt: skip


DESIGN = Design(
    "axis",
    EFFECTS,
    draw,
    {"inertia.mass": "mass", "viscous_damper.damping": "damping"},
    (1e-5, 1e-4),
    by_effort=True,
)
