"""A mass on a moved base; the displacements of both are recorded."""

import math
from collections.abc import Sequence

from rhythmid.proof.machine import Machine
from rhythmid.proof.machines.rig import Design, Rig, Rng, log_uniform
from rhythmid.proof.protocol import Run, draw_sweep, draw_tones

RATES = (200, 500, 1000)  # [Hz]
EFFECTS = (
    "cubic_stiffness", "quadratic_stiffness", "bilinear_stiffness", "coulomb_friction", "quadratic_damping",
    "travel_stop", "elastoplastic_hysteresis", "bouc_wen_hysteresis", "viscoelastic_relaxation", "second_mode",
    "freeplay", "sensor_lag",
)  # fmt: skip


def draw(rng: Rng, conceals: Sequence[str]) -> Rig:
    """0.2 to 5 kg at 2 to 8 Hz with a damping ratio of 0.02 to 0.1, on a base moved by fractions of a millimetre or more."""
    mass, natural = log_uniform(rng, 0.2, 5.0), rng.uniform(2.0, 8.0)
    omega = 2.0 * math.pi * natural
    stiffness = mass * omega**2
    damping = 2.0 * log_uniform(rng, 0.02, 0.1) * mass * omega
    base = log_uniform(rng, 0.3e-3, 3e-3)
    rate = int(rng.choice(RATES))
    machine = Machine(
        mass, stiffness, damping, 0.0, 0.0, return_damping=damping, sliding=1e-3 * base * omega, mode="base"
    )

    def tones(name: str, scale: float) -> Run:
        duration = float(rng.integers(8, 16))
        return draw_tones(
            rng, name, scale * base, 0.3 * natural, 2.5 * natural, duration, rate, 20, 1.0, start=(0.0, 0.0)
        )

    def sweep(name: str) -> Run:
        return draw_sweep(rng, name, 0.7 * base, 0.3 * natural, 2.2 * natural, 15.0, rate)

    runs = [tones("tones", 1.0), tones("tones_small", rng.uniform(0.3, 0.6)), sweep("sweep")]
    unseen = (tones("unseen_tones", rng.uniform(0.8, 1.0)), tones("unseen_small", rng.uniform(0.4, 0.6)))
    return Rig(machine, machine, tuple(runs[: rng.integers(2, 4)]), unseen, 1.5 * base, "base")


DESIGN = Design(
    "shaken",
    EFFECTS,
    draw,
    {"linear_spring.stiffness": "stiffness", "viscous_damper.damping": "damping"},
    (0.002, 0.02),
)
