"""An oscillator that is deflected and released; nothing drives it."""

import math
from collections.abc import Sequence

from rhythmid.proof.machine import Machine
from rhythmid.proof.machines.rig import Design, Rig, Rng, log_uniform
from rhythmid.proof.protocol import Run, draw_release

RATES = (50, 100, 250, 500)  # [Hz]
EFFECTS = (
    "coulomb_friction", "quadratic_drag", "cubic_stiffness", "quadratic_stiffness", "quintic_stiffness",
    "bilinear_stiffness", "position_dependent_damping", "elastoplastic_hysteresis", "viscoelastic_relaxation",
    "sensor_nonlinearity", "end_stop_contact", "second_mode",
)  # fmt: skip


def draw(rng: Rng, conceals: Sequence[str]) -> Rig:
    """0.3 to 3 kg at 0.8 to 3 Hz with a damping ratio of 0.004 to 0.03, released at 10 to 80 mm or a part of it."""
    mass, omega = log_uniform(rng, 0.3, 3.0), 2.0 * math.pi * rng.uniform(0.8, 3.0)
    stiffness = mass * omega**2
    damping = 2.0 * log_uniform(rng, 0.004, 0.03) * mass * omega
    wide = log_uniform(rng, 0.01, 0.08)
    rest = rng.uniform(-0.3, 0.3) * wide
    rate = int(rng.choice(RATES))
    machine = Machine(
        mass, stiffness, damping, rest, 0.0, return_damping=damping, sliding=min(1e-4, 1e-3 * wide * omega)
    )

    def release(name: str, share: float) -> Run:
        return draw_release(name, (rest + share * wide, 0.0), float(rng.integers(8, 18)), rate)

    runs = [
        release("wide", 1.0),
        release("other_side", -rng.uniform(0.5, 0.8)),
        release("small", rng.uniform(0.25, 0.45)),
    ]
    unseen = (release("unseen_wide", -rng.uniform(0.8, 1.0)), release("unseen_half", rng.uniform(0.4, 0.7)))
    return Rig(machine, machine, tuple(runs[: rng.integers(2, 4)]), unseen, 0.3 * wide, "nothing")


DESIGN = Design(
    "decay", EFFECTS, draw,
    {
        "linear_spring.stiffness": "stiffness", "linear_spring.rest_length": "rest_length",
        "viscous_damper.damping": "damping",
    },
    (0.002, 0.02),
    # both have three poles: a relaxation is equivalent to a lag with its own initial state
    alike=frozenset({"sensor_lag", "viscoelastic_relaxation"}),
)  # fmt: skip
