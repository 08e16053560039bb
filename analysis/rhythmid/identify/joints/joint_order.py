"""Whether the recorded joints are those that their names say: a wrong order is looked for where the efforts do not fit at all."""

from collections.abc import Iterator, Sequence
from itertools import combinations, permutations

import numpy as np
from numpy.typing import NDArray

from rhythmid.errors import InputError
from rhythmid.identify.joints.joint_motion import JointBalances

Array = NDArray[np.float64]
Order = tuple[int, ...]
# of the efforts, that the file's body with rotors, dampers and dry friction to be fitted leaves: up to it no other order is tried. Two
# exchanged joints of a leg leave 0.2, the right order 0.04 (measured, dampers alone)
ABSURD = 0.1
CLEARLY = 0.5  # of that, which another order has to leave at most
POSES = 400  # at which orders are compared
ALL = 6  # joints up to which all orders are tried (720); of more, exchanges of two, one after another


def check_order(balances: JointBalances) -> None:
    """Raise InputError where the efforts fit the model only with another order of the recorded joints."""
    joints = balances.machine.joints
    if len(joints) < 2 or any(joint not in one.stretch.effort for one in balances.bodies for joint in joints):
        return
    compared = _Compared(balances)
    given = tuple(range(len(joints)))
    error = compared.error(given)
    if error < ABSURD:
        return
    best, least = _best(compared, given, error)
    if least > CLEARLY * error:
        return
    moved = [
        f"{joint} is recorded as {joints[k]}"
        for joint, k in zip(joints, best, strict=True)
        if joints[k] != joint
    ]
    raise InputError(
        f"{balances.bodies[0].stretch.name}: the joints seem to be recorded in another order: {', '.join(moved)}. The model then misses "
        f"{100.0 * least:.0f} % of the efforts instead of {100.0 * error:.0f} %; correct 'joints:' in signals.yaml"
    )


def _best(compared: "_Compared", order: Order, error: float) -> tuple[Order, float]:
    if len(order) <= ALL:
        found = {one: compared.error(one) for one in permutations(order)}
        best = min(found, key=lambda one: found[one])
        return best, found[best]
    while True:
        tried = {one: compared.error(one) for one in _exchanges(order)}
        best = min(tried, key=lambda one: tried[one])
        if tried[best] >= error:
            return order, error
        order, error = best, tried[best]


def _exchanges(order: Order) -> Iterator[Order]:
    for first, second in combinations(range(len(order)), 2):
        changed = list(order)
        changed[first], changed[second] = changed[second], changed[first]
        yield tuple(changed)


class _Compared:
    """Poses of the records, for whatever order of the driven joints."""

    def __init__(self, balances: JointBalances) -> None:
        self._body = balances.machine.body
        own = [self._body.joints[joint] for joint in balances.machine.joints]
        self._position, self._velocity = [one.position for one in own], [one.velocity for one in own]
        self._pose = _picked([one.pose for one in balances.bodies])
        self._rate = _picked([one.rate for one in balances.bodies])
        self._acceleration = _picked([one.acceleration for one in balances.bodies])
        efforts = [
            np.column_stack([one.stretch.effort[joint][:: one.every] for joint in balances.machine.joints])
            for one in balances.bodies
        ]
        self._effort = _picked(efforts)

    def error(self, order: Order) -> float:
        """What is left of the efforts, as a share of them, where joint k is what is recorded as joint `order[k]`."""
        pose, rate, acceleration = self._pose.copy(), self._rate.copy(), self._acceleration.copy()
        chosen = list(order)
        pose[:, self._position] = self._pose[:, [self._position[k] for k in chosen]]
        for values, known in ((rate, self._rate), (acceleration, self._acceleration)):
            values[:, self._velocity] = known[:, [self._velocity[k] for k in chosen]]
        force = self._body.inverse(pose, rate, acceleration)
        left = []
        for place, k in enumerate(chosen):
            own = self._velocity[place]
            effort, v = self._effort[:, k], rate[:, own]
            columns = np.column_stack([acceleration[:, own], v, np.sign(v), np.ones(len(v))])
            rest = effort - force[:, own]
            rest = rest - columns @ np.linalg.lstsq(columns, rest, rcond=None)[0]
            left.append(float(np.mean(rest**2) / max(float(np.mean(effort**2)), 1e-300)))
        return float(np.sqrt(np.mean(left)))


def _picked(parts: Sequence[Array]) -> Array:
    """Evenly picked rows of all stretches."""
    whole = np.concatenate(parts)
    return whole[:: max(1, len(whole) // POSES)]
