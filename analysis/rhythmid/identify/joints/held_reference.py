"""Efforts that are recorded in step with held references: instantaneous values or means over the period.

The samples alone do not tell which of the two they are. The two readings differ by damping and inertia at every
joint, in proportion to its controller's gains. So signals.yaml may declare it. Otherwise a diagnosis chooses one
lead for all joints if with it the efforts of most joints fit the model better. A missing effect at a few joints
does not improve the other joints; at these few joints the lead may make the fit worse. An effect at many joints,
such as a link's mass, can hide the lead or exaggerate it. So where a reading leaves several causes, the other
readings are searched as well, for one that needs fewer causes. An identification cannot tell, because inertia and
damping are unknown there.
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
LEADS = 121  # number of leads that are compared
FURTHEST = 1.2  # largest lead either way, in half periods: an optimum at the end represents another effect
SCATTERED = (
    2.0 / 3.0,
    1.0,
)  # share of the lead of instantaneous efforts that remains on average when timestamps scatter
LESS = np.log(
    0.95
)  # logarithm of the ratio to which the median error of all joints has to fall before a lead is accepted
NO_WORSE = 1e-9  # relative increase of a joint's error that rounding may cause


def balances_of(machine: Machine, records: Sequence[JointRecord]) -> JointBalances:
    """The balances of records, without the lead of references where signals.yaml declares efforts as instantaneous.

    Raises InputError where the records hold too little."""
    plain = JointBalances.of(machine, records)
    return plain.with_leads(_of_instants(plain)) if records[0].sampled == "instant" else plain


def _of_instants(balances: JointBalances) -> dict[str, float]:
    """Lead [s] of each joint whose effort was recorded at the instants at which its reference changes."""
    step = balances.machine.body.step  # time for which the machine's controllers hold their commands
    return {joint: 0.5 * max(period - step, 0.0) for joint, period in _periods(balances).items()}


@threadpool_limits.wrap(limits=1)
def likely_readings(balances: JointBalances, records: Sequence[JointRecord]) -> list[JointBalances]:
    """Possible readings of the balances where the sampling of efforts is not declared, the likeliest first: without
    the lead with which most joints fit better, else unchanged; and without the lead that instantaneous efforts
    have."""
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
    """The lead among `tried` (l,) with which most joints fit better; None where there is none.

    Parameters
    ----------
    change : (joints, l) logarithm of the ratio of each joint's error to that without a lead.
    """
    middle = np.median(change, axis=0)
    best = int(np.argmin(middle))
    better = np.mean(change[:, best] <= NO_WORSE)
    if best in (0, len(tried) - 1) or better <= 0.5 or middle[best] > LESS:
        return None
    return float(tried[best])


def not_told(balances: JointBalances, records: Sequence[JointRecord]) -> Iterator[str]:
    """What an identification cannot determine where signals.yaml does not declare how efforts were sampled."""
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
    """Effort error of a joint's fitted nominal path for each lead, to first order in the lead and the parameters."""
    balance, model = balances.balance(joint), balances.models[joint]
    residual, columns = linearise(balance, model, balance.estimated(model), 0.0)
    moved = balances.with_leads({joint: half}).balance(joint)
    slope = (moved.measured - balance.measured) / half
    sizes = np.linalg.norm(columns, axis=0)
    columns = columns[:, sizes > 0.0] / sizes[sizes > 0.0]
    left = np.column_stack([residual, slope])
    left = left - columns @ np.linalg.lstsq(columns, left, rcond=None)[0]
    return np.linalg.norm(left[:, :1] - left[:, 1:] * tried, axis=0)
