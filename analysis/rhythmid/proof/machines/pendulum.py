"""A pendulum with a large swing, released or driven by a known torque; its angle is recorded."""

import math
from collections.abc import Sequence
from dataclasses import replace

from rhythmid.proof.machine import Effect, Machine
from rhythmid.proof.machines.rig import Design, Rig, Rng, log_uniform
from rhythmid.proof.protocol import Run, draw_release, draw_tones

RATES = (50, 100, 200)  # [Hz]
EFFECTS = (
    "pendulum_gravity", "coulomb_friction", "quadratic_drag", "position_dependent_damping", "position_ripple",
    "elastoplastic_hysteresis", "bouc_wen_hysteresis", "viscoelastic_relaxation",
)  # fmt: skip


def draw(rng: Rng, conceals: Sequence[str]) -> Rig:
    """A pendulum of 0.6 to 1.5 Hz for small swings, with swings of 0.6 to 2 rad.

    If its gravity is concealed, the nominal model has a spring instead, which is correct for small swings.
    """
    inertia = log_uniform(rng, 0.005, 0.5)
    omega = 2.0 * math.pi * rng.uniform(0.6, 1.5)
    moment = inertia * omega**2
    damping = 2.0 * log_uniform(rng, 0.004, 0.03) * inertia * omega
    rate = int(rng.choice(RATES))
    machine = Machine(inertia, 0.0, damping, 0.0, 0.0, return_damping=damping, moment=moment, sliding=2e-3)
    lacks, believed = None, machine
    if "pendulum_gravity" in conceals:
        lacks = Effect("pendulum_gravity", {"moment": moment, "reference": 0.0})
        believed = replace(machine, moment=0.0, stiffness=moment)
    wide = rng.uniform(1.0, 2.0)
    driven = rng.random() < 0.5

    def swing(name: str, share: float) -> Run:
        start = (share * wide, 0.0)
        duration = float(rng.integers(12, 25))
        if not driven:
            return draw_release(name, start, duration, rate)
        return draw_tones(rng, name, 0.06 * moment, 0.3, 2.0, duration, rate, start=start)

    runs = [swing("wide", 1.0), swing("half", -rng.uniform(0.4, 0.6)), swing("other", rng.uniform(0.6, 0.9))]
    unseen = (swing("unseen_wide", -rng.uniform(0.8, 1.0)), swing("unseen_half", rng.uniform(0.3, 0.6)))
    return Rig(
        machine, believed, tuple(runs[: rng.integers(2, 4)]), unseen, 0.3 * wide,
        "command" if driven else "nothing", lacks=lacks, units=("N*m", "rad"),
    )  # fmt: skip


DESIGN = Design(
    "pendulum", EFFECTS, draw,
    {
        "viscous_damper.damping": "damping", "pendulum_gravity.moment": "moment", "linear_spring.stiffness": "stiffness",
    },
    (0.003, 0.02),
)  # fmt: skip
