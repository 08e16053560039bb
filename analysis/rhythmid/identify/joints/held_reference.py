"""Efforts that were recorded in step with references that are held: what is made of them.

Such samples do not tell whether an effort is that of the instant or the mean over the period: the readings differ by damping and inertia at
every joint in proportion to its controller's gains. So signals.yaml may say which it is. Where it does not, a diagnosis takes one lead for
all joints that makes the efforts of most joints fit the model better, which an effect that a few joints lack does not do to the others; at
these few the lead may do harm. An effect that many joints feel, such as a link's mass, hides the lead or exaggerates it. So where a reading
leaves several causes, the other readings are searched as well, for one that needs fewer. An identification, to which inertia and damping are
unknown, cannot tell.
"""

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray
from threadpoolctl import threadpool_limits

from rhythmid.body.machine import Machine
from rhythmid.errors import InputError
from rhythmid.identify.inverse_dynamics.estimate import linearise
from rhythmid.identify.joints.joint_motion import JointBalances
from rhythmid.record.joint_record import JointRecord

Array = NDArray[np.float64]
LEADS = 121  # that are compared
FURTHEST = 1.2  # times half a period, ahead or behind, up to which: at an end it stands for something else
SCATTERED = (
    2.0 / 3.0,
    1.0,
)  # of the lead of efforts at the very instants, that they have on average whose stamps scatter
LESS = np.log(
    0.95
)  # logarithm of the share to which the error of the middle one of all joints has to fall for a lead to be believed in
NO_WORSE = 1e-9  # of a joint's error, by which rounding may raise it


def balances_of(machine: Machine, records: Sequence[JointRecord]) -> JointBalances:
    """The balances of records, with the lead of references taken away where signals.yaml says that efforts are those of an instant.

    Raises InputError where the records hold too little."""
    plain = JointBalances.of(machine, records)
    return plain.with_leads(_of_instants(plain)) if records[0].sampled == "instant" else plain


def _of_instants(balances: JointBalances) -> dict[str, float]:
    """The lead [s] of each joint whose effort was recorded at the instants at which its reference jumps."""
    step = balances.machine.body.step  # for which the machine's controllers hold what they ask for
    return {joint: 0.5 * max(period - step, 0.0) for joint, period in _periods(balances).items()}


@threadpool_limits.wrap(limits=1)
def likely_readings(balances: JointBalances, records: Sequence[JointRecord]) -> list[JointBalances]:
    """The balances as they may have to be read where nothing is said of how efforts were sampled, the likeliest first: with the lead taken
    away from all joints that most joints fit better with, else as they are; and with those that efforts of instants have."""
    periods = _periods(balances)
    if records[0].sampled is not None or not periods:
        return [balances]
    furthest = FURTHEST * 0.5 * max(periods.values())
    tried = np.linspace(-furthest, furthest, LEADS)
    errors = []
    for joint in periods:
        try:
            errors.append(_errors(balances, joint, furthest, tried))
        except InputError:
            continue  # too little motion
    if not errors:
        return [balances]
    change = np.log(errors) - np.log([[np.interp(0.0, tried, one)] for one in errors])
    instant = float(np.median(list(_of_instants(balances).values())))
    leads = [lead_of_most(tried, change) or 0.0, 0.0, *(share * instant for share in SCATTERED)]
    return [
        balances.with_leads(dict.fromkeys(periods, one)) if one else balances for one in dict.fromkeys(leads)
    ]


def lead_of_most(tried: Array, change: Array) -> float | None:
    """The lead of those `tried` (l,) that most joints fit better with, None where there is none.

    Parameters
    ----------
    change : (joints, l) logarithm of each joint's error over that without a lead.
    """
    middle = np.median(change, axis=0)
    best = int(np.argmin(middle))
    better = np.mean(change[:, best] <= NO_WORSE)
    if best in (0, len(tried) - 1) or better <= 0.5 or middle[best] > LESS:
        return None
    return float(tried[best])


def not_told(balances: JointBalances, records: Sequence[JointRecord]) -> Iterator[str]:
    """What an identification cannot tell where signals.yaml does not say how efforts were sampled."""
    periods = _periods(balances)
    if records[0].sampled is not None or not periods:
        return
    half = 0.5 * max(periods.values())
    gains = [
        [balances.machine.paths[joint].value(f"position_control.{name}") for joint in periods]
        for name in ("proportional", "derivative")
    ]
    yield (
        f"damping and armature of {', '.join(periods)}, and how their efforts were sampled: were these recorded at the instants at which held "
        f"references jump, the damping is up to {half * max(gains[0]):.2g} and the armature up to {half * max(gains[1]):.2g} less; say it with "
        "sampled: mean or instant under 'effort:'"
    )


def _periods(balances: JointBalances) -> dict[str, float]:
    return {joint: one.period for body in balances.bodies for joint, one in body.stretch.held.items()}


def _errors(balances: JointBalances, joint: str, half: float, tried: np.ndarray) -> np.ndarray:
    """What a joint's nominal path, fitted, misses of its effort with each lead; to first order in the lead and the parameters."""
    balance, model = balances.balance(joint), balances.models[joint]
    residual, columns = linearise(balance, model, balance.estimated(model), 0.0)
    moved = balances.with_leads({joint: half}).balance(joint)
    slope = (moved.measured - balance.measured) / half
    sizes = np.linalg.norm(columns, axis=0)
    columns = columns[:, sizes > 0.0] / sizes[sizes > 0.0]
    left = np.column_stack([residual, slope])
    left = left - columns @ np.linalg.lstsq(columns, left, rcond=None)[0]
    return np.linalg.norm(left[:, :1] - left[:, 1:] * tried, axis=0)
