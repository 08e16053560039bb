"""Links whose masses the recorded motion does not separate, and their mass together.

Where the links behind a joint hardly move against each other, a kilogram on one has nearly the effect of some kilograms on another at every
joint that feels both. Their columns are collinear, and only a sum of their masses is known: a base parameter (M. Gautier, IFAC Proc. 23 (1990)
455).
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rhythmid.body.inertial_parameter import MASS, split
from rhythmid.body.mujoco_body import MujocoBody
from rhythmid.diagnose.answer.result import Estimate
from rhythmid.diagnose.constants import CONTRADICTS
from rhythmid.diagnose.joints.joint_case import JointResult
from rhythmid.diagnose.joints.link_evidence import own_path
from rhythmid.diagnose.joints.machine_cause import rows_of
from rhythmid.identify.inverse_dynamics.estimate import fit_effort
from rhythmid.identify.joints.joint_motion import JointBalances

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Together:
    """Further `links` of a group, the mass of the whole group [kg], and the one `given` in the file."""

    links: tuple[str, ...]
    mass: Estimate
    given: Estimate


def masses_alike(
    corrected: JointBalances, found: Mapping[str, JointResult], parameter: str, mass: Estimate, given: float
) -> Together | None:
    """The links that a link carries whose masses the efforts do not separate from its change of mass; None without one.

    `corrected` are the balances with the link's new `mass` [kg] instead of the `given` one.
    """
    body = corrected.machine.body
    link, _ = split(parameter)
    change = mass.value - given
    others = carried(body, link)
    joints = [joint for joint in found if parameter in corrected.links(joint)]
    if not others or not joints or change == 0.0:
        return None
    columns = np.concatenate([_columns(corrected, found[joint], (link, *others)) for joint in joints])
    _, covariance = changes(columns, change)
    # what the records leave open of each change, the others free: members are those that may have all of it
    open_ = CONTRADICTS * np.sqrt(np.diag(covariance)) > sizes(columns, change)
    same = [k for k in range(1, len(open_)) if open_[0] and open_[k]]
    if not same:
        return None
    names = tuple(others[k - 1] for k in same)
    shares, covariance = changes(columns[:, [0, *same]], change)
    added, std = float(shares.sum()), float(np.sqrt(covariance.sum()))
    before = given + sum(body.parameters[f"{name}.{MASS}"] for name in names)
    spread = math.hypot(std, mass.std or 0.0)
    return Together(names, Estimate(before + added, spread, "kg"), Estimate(before, 0.0, "kg"))


def carried(body: MujocoBody, link: str) -> tuple[str, ...]:
    """The links that a link carries."""
    parents, own = body.model.body_parentid, body.links[link]

    def above(number: int) -> bool:
        while number:
            number = int(parents[number])
            if number == own:
                return True
        return False

    return tuple(name for name, number in body.links.items() if above(number))


def _columns(balances: JointBalances, one: JointResult, links: Sequence[str]) -> Array:
    """Effects (n, links) of a kilogram more on each link at a joint, in units of the noise; what the joint's path explains is projected out."""
    body, balance = balances.machine.body, balances.balance(one.joint, one.late)
    fit, turns = fit_effort(balance, own_path(balances, one)), body.joints[one.joint].velocity
    per_kilogram = {link: body.own(link).ten / body.own(link).mass for link in links}
    made = [
        np.column_stack(
            [
                body.inertial_columns(link, at.pose, at.rate, at.acceleration)[:, turns] @ ten
                for link, ten in per_kilogram.items()
            ]
        )
        for at in balances.bodies
    ]
    return rows_of(balance, fit, made)[1]


def sizes(columns: Array, change: float) -> Array:
    """The largest change (p,) of each mass that the `change` of the first one may stand for: less where a kilogram has more effect."""
    strength = np.linalg.norm(columns, axis=0)
    return abs(change) * np.minimum(1.0, strength[0] / np.maximum(strength, 1e-300))


def changes(columns: Array, change: float) -> tuple[Array, Array]:
    """Changes (p,) of masses with these columns (n, p) that explain the `change` of the first one, and their covariance (p, p).

    Each has its size as prior, so that collinear columns share the change.
    """
    normal = columns.T @ columns + np.diag(sizes(columns, change) ** -2)
    covariance = np.asarray(np.linalg.inv(normal), dtype=np.float64)
    return covariance @ (columns.T @ columns[:, 0]) * change, covariance
