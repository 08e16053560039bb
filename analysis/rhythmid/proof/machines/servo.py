"""A position servo of which only the command and the motion are recorded."""

from collections.abc import Sequence

from rhythmid.proof.machine import Machine
from rhythmid.proof.machines.rig import LAGS, Design, Rig, Rng
from rhythmid.proof.protocol import Run, draw_moves, draw_tones, from_reference

RATES = (50, 100, 200)  # [Hz]
EFFECTS = (
    "actuator_saturation", "actuator_deadband", "reference_rate_limit", "coulomb_friction", "command_lag",
    "constant_force", "asymmetric_coulomb_friction", "quadratic_drag", "second_mode",
)  # fmt: skip


def draw(rng: Rng, conceals: Sequence[str]) -> Rig:
    """A loop of 10 to 25 rad/s, all forces per unit of inertia, with a delay of up to 30 ms in the command."""
    omega, ratio = rng.uniform(10.0, 25.0), rng.uniform(0.5, 0.9)
    travel = rng.uniform(0.3, 0.9)
    rate = int(rng.choice(RATES))
    machine = Machine(
        1.0, 0.0, 0.0, 0.0, 0.0, proportional=omega**2, derivative=2.0 * ratio * omega, sliding=1e-3 * travel,
        mode="continuous",
    )  # fmt: skip

    def moves(name: str) -> Run:
        return draw_moves(rng, name, (-travel, travel), float(rng.integers(10, 18)), rate, 0.2, 0.9)

    def tones(name: str) -> Run:
        duration = float(rng.integers(10, 18))
        return from_reference(draw_tones(rng, name, 0.4 * travel, 0.2, 3.0, duration, rate, falls=0.7))

    runs = [moves("moves"), tones("tones"), moves("moves_again")]
    return Rig(
        machine, machine, tuple(runs[: rng.integers(2, 4)]), (moves("unseen_moves"), tones("unseen_tones")),
        0.5 * travel, "reference", input_delay=rng.uniform(0.0, 0.03), units=("rad/s^2", "rad"),
    )  # fmt: skip


DESIGN = Design(
    "servo", EFFECTS, draw, {"position_control.proportional": "proportional", "position_control.derivative": "derivative"},
    (0.002, 0.01), delays=("input",), alike=LAGS,
)  # fmt: skip
