"""Whether records can be scored by their effort, and whether a free run is meaningful. Both are questions of
identifiability, not of the form of the motion."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from threadpoolctl import threadpool_limits

from rhythmid.errors import InputError
from rhythmid.identify.drive import controlled
from rhythmid.identify.inverse_dynamics.balance import Balance
from rhythmid.identify.inverse_dynamics.bandwidth import MUCH, Bandwidth
from rhythmid.identify.inverse_dynamics.effort_noise import effort_is_noisier
from rhythmid.identify.inverse_dynamics.estimate import condition_of, fit_effort, size_of
from rhythmid.identify.inverse_dynamics.rests import told
from rhythmid.model import INERTIA, Model
from rhythmid.record.record import Record
from rhythmid.simulation.effect import Path, effect_along
from rhythmid.simulation.right_hand_side import OutputKind

# condition number of the scaled regressor above which a robot's parameters are not sufficiently excited (K.
# Schröer, in: Robot Calibration, Chapman & Hall, 1993; M. Gautier, W. Khalil, Int. J. Robot. Res. 11 (1992) 362 aim
# below it)
CONDITION = 100.0
# least share of the effort's power that a free map of the motion explains in the band of the map; with less, this effort does not make
# the motion
EXPLAINED_BY_MOTION = 0.5
# least variation of the effort relative to the inertial force: below it the machine swings freely, and the balance
# is a small difference of two large terms (a resonance of 10 % damping is driven by a fifth of its inertial force)
LIGHT = 0.2
# least variation of the effort, as a share of its size: an effort that is constant but for less than what is of practical
# importance is one operating point, and the noise of the motion decides between its explanations
LEAST_VARIATION = 0.005
POINTS = 50  # positions at which a restoring force is evaluated


@dataclass(frozen=True)
class Applicability:
    """Whether the effort can be scored, with the reasons.

    `condition` is the condition number of the scaled columns, `explained` the share of the effort's power that the
    motion explains, `effort_share` the effort's variation as a share of the inertial force. `restoring` says
    whether the model has a restoring force for the measured quantity, `closed` whether it has a controller. A long
    free run is meaningful for a machine with a restoring force and without a controller. `recorded` says whether
    there are rows of effort, `notes` which of them were interpolated, and which band is not compared although the
    effort goes with the motion there; `band_left_out` says whether there is one. `noisier` says whether the
    effort has more noise than the motion, so that a free run would be driven by noise. `balance` holds the
    rows. It is None where a free run may come first: the rows of long records are large, and a search rebuilds them where needed.
    """

    applies: bool
    reason: str
    bandwidth: float
    condition: float
    explained: float
    effort_share: float
    restoring: bool
    closed: bool
    recorded: bool = True
    notes: tuple[str, ...] = ()
    balance: Balance | None = None
    band_left_out: bool = False
    noisier: bool = False

    @property
    def free_run_is_informative(self) -> bool:
        """Whether a long free run of the model does not accumulate every small disturbance."""
        return self.restoring and not self.closed


@threadpool_limits.wrap(limits=1)  # many small matrices: threads would wait for each other
def applicable(records: Sequence[Record], model: Model) -> Applicability:
    """Whether these records can be scored by the predicted effort of the model."""
    closed = controlled(model)
    try:
        balance = Balance.of(records, model)
    except InputError as error:
        return Applicability(False, str(error), 0.0, np.inf, 0.0, 0.0, True, closed, recorded=False)
    chosen = balance.bandwidth
    fit = fit_effort(balance, model, steps=3)
    condition = condition_of(fit)
    driven = balance.motions[0].driven_by_base
    share = 1.0 if driven else float(np.std(balance.measured)) / max(_inertial(balance, model), 1e-300)
    reason = f"the effort is predicted below {chosen.effort:.3g} Hz, where the motion explains {chosen.explained:.0%} of it"
    reason = "; ".join(filter(None, (reason, told(balance.stuck))))
    applies = True
    if chosen.mapped < EXPLAINED_BY_MOTION:
        applies, reason = (
            False,
            f"no map of the motion explains more than {chosen.mapped:.0%} of the effort",
        )
    elif (varies := float(np.std(balance.measured)) / size_of(balance)) < LEAST_VARIATION:
        applies, reason = (
            False,
            f"the effort varies by {varies:.1%} of its size only, outside rests: one operating point does not separate its causes",
        )
    elif share < LIGHT:
        applies, reason = (
            False,
            f"the effort varies by {share:.0%} of the inertial force: the machine swings by itself",
        )
    elif condition > CONDITION:
        applies, reason = (
            False,
            f"the motion does not separate the parameters (condition number {condition:.3g})",
        )
    restoring = restores(balance, model, records[0].output_kind)
    means_something = restoring and not closed
    left_out = _left_out(chosen)
    return Applicability(
        applies, reason, chosen.effort, condition, chosen.explained, share,
        restoring, closed, True, (*balance.notes, *left_out), None if means_something else balance, bool(left_out),
        applies and not driven and effort_is_noisier(balance, records, fit.model),
    )  # fmt: skip


def _left_out(chosen: Bandwidth) -> list[str]:
    """A note on the band above that of the comparison, where it holds much of the effort that goes with the motion."""
    if chosen.left_out < MUCH:
        return []
    return [
        f"the effort goes with the motion up to {chosen.left_out_to:.3g} Hz; what lies above {chosen.effort:.3g} Hz, "
        f"{chosen.left_out:.0%} of its power, is not compared by effort"
    ]


def _inertial(balance: Balance, model: Model) -> float:
    """Size (rms about its mean) of the inertial force in the effort's unit, for example a motor's voltage."""
    heavier = model.with_values({INERTIA: 1.01 * model.mass.value})
    return float(np.std(balance.predicted(heavier) - balance.predicted(model))) / 0.01


def restores(balance: Balance, model: Model, measured: OutputKind = "position") -> bool:
    """Whether the model's forces push the measured quantity back from both ends of its range: the position at rest,
    or the velocity of a machine where only the velocity is measured."""
    of_speed = measured == "velocity"
    signal = [motion.leg_velocity if of_speed else motion.leg_position for motion in balance.motions]
    span = np.linspace(float(np.min(np.concatenate(signal))), float(np.max(np.concatenate(signal))), POINTS)
    zero, total = np.zeros(POINTS), np.zeros(POINTS)
    position, velocity = (zero, span) if of_speed else (span, zero)
    path = Path(np.linspace(0.0, 1.0, POINTS), position, velocity, zero, zero, zero)
    for term in model.terms:
        if term.element.slot == "force" and term.element.acts in ("leg", "body"):
            total += effect_along(term.element, term.numbers, model, path)
    return bool(total[0] - total[-1] > 1e-9 * max(float(np.abs(total).max()), 1e-300))
