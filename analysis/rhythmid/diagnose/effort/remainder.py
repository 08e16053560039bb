"""The residual effort of an explanation: the quantity that it depends on, and its curve over that quantity."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from rhythmid.diagnose.effort.fitted import Fitted
from rhythmid.identify.inverse_dynamics.balance import Balance

Array = NDArray[np.float64]
BINS = 16  # bins with equal numbers of rows: enough for a curve, each with enough rows for a mean
SPEED_OF = "the velocity of "  # before the name of another joint


@dataclass(frozen=True, eq=False)
class Curve:
    """Mean residual effort (b,) over values (b,) of a quantity.

    `share` is the part of the residual's power that the curve explains beyond chance. `joint` is the other joint whose speed
    the quantity is.
    """

    quantity: str
    value: Array
    mean: Array
    share: float
    joint: str | None = None


def remainder_of(balance: Balance, fitted: Fitted) -> tuple[Curve, ...]:
    """Curves of the residual effort (recorded less predicted), the most informative quantity first.

    Quantities are speed, position, acceleration, load and time, and the speeds of other joints.
    """
    left = -fitted.fit.residual
    mechanical = balance.mechanical
    time = np.concatenate([m.time[p] for m, p in zip(balance.motions, balance.places, strict=True)])
    quantities = {
        "velocity": mechanical[:, 1],
        "position": mechanical[:, 0],
        "acceleration": mechanical[:, 2],
        "load": balance.measured - left,
        "time": time,
    }
    curves = [_curve(name, value, left) for name, value in quantities.items()]
    for joint in balance.motions[0].others:
        speed = np.concatenate(
            [m.others[joint][p] for m, p in zip(balance.motions, balance.places, strict=True)]
        )
        curves.append(replace(_curve(SPEED_OF + joint, speed, left), joint=joint))
    return tuple(sorted(curves, key=lambda one: -one.share))


def _curve(quantity: str, value: Array, left: Array) -> Curve:
    order = np.argsort(value, kind="stable")
    groups = [group for group in np.array_split(order, BINS) if len(group)]
    centre = np.array([float(np.median(value[group])) for group in groups])
    mean = np.array([float(np.mean(left[group])) for group in groups])
    counts = np.array([len(group) for group in groups], dtype=float)
    between = float(np.sum(counts * (mean - left.mean()) ** 2))
    total = float(np.sum((left - left.mean()) ** 2))
    within = (total - between) / max(len(left) - len(groups), 1)
    share = (between - (len(groups) - 1) * within) / total if total > 0.0 else 0.0
    return Curve(quantity, centre, mean, max(share, 0.0))
