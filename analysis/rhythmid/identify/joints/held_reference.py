"""Efforts that were recorded in step with references that are held: what is made of them.

Such samples do not tell whether an effort is that of the instant or the mean over the period: the readings differ by damping and inertia at
every joint in proportion to its controller's gains. So signals.yaml may say which it is. Where it does not, a diagnosis takes one lead for
all joints that makes the efforts of every joint fit the model better, which an effect that a joint lacks does not do to the others. An
identification, to which inertia and damping are unknown, cannot.
"""

from collections.abc import Iterator, Sequence

import numpy as np
from threadpoolctl import threadpool_limits

from rhythmid.body.machine import Machine
from rhythmid.errors import InputError
from rhythmid.identify.inverse_dynamics.estimate import linearise
from rhythmid.identify.joints.joint_motion import JointBalances
from rhythmid.record.joint_record import JointRecord

LEADS = 101  # that are compared, from half a period behind to half a period ahead
BETTER = 0.05  # of a joint's error on average, by which it has to fall for a lead to be believed in
NO_WORSE = 1e-9  # of a joint's error, by which rounding may raise it


def balances_of(machine: Machine, records: Sequence[JointRecord]) -> JointBalances:
    """The balances of records, with the lead of references taken away where signals.yaml says that efforts are those of an instant.

    Raises InputError where the records hold too little."""
    plain = JointBalances.of(machine, records)
    if records[0].sampled != "instant":
        return plain
    step = machine.body.step  # for which the machine's controllers hold what they ask for
    return plain.with_leads(
        {joint: 0.5 * max(period - step, 0.0) for joint, period in _periods(plain).items()}
    )


@threadpool_limits.wrap(limits=1)
def with_likely_lead(balances: JointBalances, records: Sequence[JointRecord]) -> JointBalances:
    """The balances with one lead taken away from all joints, where nothing is said of it and every joint fits the model better so."""
    periods = _periods(balances)
    if records[0].sampled is not None or not periods:
        return balances
    half = 0.5 * max(periods.values())
    tried = np.linspace(-half, half, LEADS)
    errors = []
    for joint in periods:
        try:
            errors.append(_errors(balances, joint, half, tried))
        except InputError:
            continue  # too little motion
    if not errors:
        return balances
    before = np.array([np.interp(0.0, tried, one) for one in errors])
    best = int(np.argmin(np.sum(np.log(errors), axis=0)))
    change = np.array([one[best] for one in errors]) / before
    if np.any(change > 1.0 + NO_WORSE) or np.mean(np.log(change)) > np.log(1.0 - BETTER):
        return balances
    return balances.with_leads(dict.fromkeys(periods, float(tried[best])))


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
