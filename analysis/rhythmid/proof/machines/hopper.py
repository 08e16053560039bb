"""The hopper: a hanging or lying mass whose damper works in stance only, kept on a limit cycle by its forcing."""

import math
from collections.abc import Sequence

import numpy as np

from rhythmid.proof.machine import Forcing, Machine
from rhythmid.proof.machines.rig import Design, Rig, Rng
from rhythmid.proof.protocol import PUMPING, draw_runs

LONGEST_DELAY = {"input": 0.080, "measurement": 0.100}  # [s]
EFFECTS = (
    "command_lag", "command_hold", "input_delay_drift", "actuator_lag", "actuator_saturation",
    "actuator_rate_limit", "actuator_deadband", "actuator_nonlinearity", "actuator_fade", "backlash",
    "coulomb_friction", "asymmetric_coulomb_friction", "stribeck_friction", "load_dependent_friction",
    "elastoplastic_hysteresis", "bouc_wen_hysteresis", "viscous_damper", "flight_damping", "switching_threshold",
    "position_dependent_damping", "quadratic_drag", "quadratic_stiffness", "cubic_stiffness", "quintic_stiffness",
    "bilinear_stiffness", "freeplay", "viscoelastic_relaxation", "stiffness_drift", "stiffness_jump",
    "ground_contact_loss", "end_stop_contact", "position_ripple", "periodic_disturbance", "second_mode",
    "sensor_drift", "sensor_lag", "sensor_nonlinearity", "clock_skew", "delay_drift",
)  # fmt: skip


def _draw_machine(rng: Rng) -> tuple[Machine, Forcing, float]:
    """A machine, its forcing, and the intended amplitude [m] of the limit cycle."""
    stiffness = math.exp(rng.uniform(math.log(50.0), math.log(800.0)))
    natural = rng.uniform(1.2, 3.5)
    mass = float(np.clip(stiffness / (2.0 * math.pi * natural) ** 2, 0.5, 3.0))
    natural = math.sqrt(stiffness / mass) / (2.0 * math.pi)
    damping = 2.0 * math.exp(rng.uniform(math.log(0.03), math.log(0.15))) * math.sqrt(stiffness * mass)
    gravity = 9.81 if rng.random() < 0.8 else 0.0
    machine = Machine(mass, stiffness, damping, rng.uniform(0.1, 0.4), gravity)
    away = [f for f in PUMPING if abs(f / natural - 1.0) > 0.25]
    pumping = float(rng.choice(away))
    cycle = math.exp(rng.uniform(math.log(0.003), math.log(0.010)))
    amplitude = cycle * stiffness * abs(1.0 - (pumping / natural) ** 2)
    return machine, Forcing(amplitude, pumping, rng.uniform(-math.pi, math.pi)), cycle


def draw(rng: Rng, conceals: Sequence[str]) -> Rig:
    """A hopper with three to six records."""
    machine, forcing, cycle = _draw_machine(rng)
    natural = math.sqrt(machine.stiffness / machine.mass) / (2.0 * math.pi)
    runs, unseen = draw_runs(rng, forcing.amplitude, natural, forcing.frequency)
    delays = rng.uniform(0.0, LONGEST_DELAY["input"]), rng.uniform(0.0, LONGEST_DELAY["measurement"])
    return Rig(machine, machine, runs, unseen, cycle, "command", forcing, *delays)


DESIGN = Design(
    "hopper", EFFECTS, draw,
    {
        "linear_spring.stiffness": "stiffness", "switched_damper.stance": "damping",
        "linear_spring.rest_length": "rest_length",
    },
    (0.008, 0.03), delays=("input", "measurement"), bags=True,
    # for friction that differs by direction the level is identifiable only if the rest length has been measured
    known_with={"asymmetric_coulomb_friction": ("rest_length",)},
)  # fmt: skip
