"""Power that a recorded effort takes from a joint beyond what the body requires.

Weight, coupling and inertia return what they take. Every other passive part of a joint dissipates: on average its motor has to supply power,
whatever the law of its losses is. An effort that on average brakes more than the body requires is not the effort of the whole drive.

A wrong weight returns what it takes only where the motion does, and a short record need not: what any masses, inertias and payloads of the links
can explain is left out.
"""

import numpy as np
from numpy.typing import NDArray

from rhythmid.identify.inverse_dynamics.balance import Balance
from rhythmid.model import Model

Array = NDArray[np.float64]
# correlation of speed and effort beyond the body's from which an effort counts as braking (measured on two robots: joints that dissipate have
# 0.4 to 0.97, one with links three times too light has 0.0; joints with a compensation in the drive have -0.6 and -0.97)
BRAKES = -0.3
SLOW = 0.05  # share of the largest speed (95 % quantile) within which a dry friction changes its sign
RATES = {True: "N*m*s/rad", False: "N*s/m"}  # effort per speed, of rotational and of other joints


def braking_note(joint: str, balance: Balance, model: Model, rotational: bool) -> str | None:
    """What to check at a joint whose recorded effort falls with its speed; None where it does not, or where no effort was recorded.

    Parameters
    ----------
    balance, model : of the joint, as declared.
    rotational : whether the joint turns.
    """
    if balance.by_reference or balance.undriven:
        return None
    position, speed, acceleration = balance.mechanical.T
    zero = np.zeros(1)
    body = [
        model.mass.value * one.acceleration + (zero if one.coupling is None else one.coupling)
        for one in balance.motions
    ]
    beyond = balance.measured - balance.rows(body)
    columns = _of_links(balance)
    beyond = beyond - columns @ np.linalg.lstsq(columns, beyond, rcond=None)[0]
    size = float(np.sqrt(np.mean(beyond**2) * np.mean(speed**2)))
    if size == 0.0 or float(np.mean(beyond * speed)) >= BRAKES * size:
        return None
    way = np.tanh(speed / (SLOW * float(np.quantile(np.abs(speed), 0.95))))
    columns = np.column_stack([speed, way, position, acceleration, np.ones(len(speed)), columns])
    slope = float(np.linalg.lstsq(columns, beyond, rcond=None)[0][0])
    return (
        f"{joint}: the recorded effort falls with the speed, by {abs(slope):.2g} {RATES[rotational]}, and brakes the motion on average; no passive part of a "
        "joint needs that. The record of the effort lacks a part that grows with the speed, such as a compensation of friction in the drive, "
        "or its sign is wrong"
    )


def _of_links(balance: Balance) -> Array:
    """Efforts (n, p) at the rows of a joint's balance per unit of each parameter of the links that it feels."""
    made = [balance.rows(one.links[name][1] for one in balance.motions) for name in balance.motions[0].links]
    return np.column_stack(made) if made else np.zeros((len(balance.measured), 0))
