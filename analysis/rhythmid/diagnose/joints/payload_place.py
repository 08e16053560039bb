"""Place of a payload in the frame of its link, and its mass, from the efforts of all joints that feel it.

The search assumes a point mass at the end of the link. The centre of a gripper or a foot is close to this point but not at it; the
remaining mismatch would be attributed to a wrong mass or rotor. The force of a point mass is linear in its mass, its first moment and
its inertia (M. Gautier, W. Khalil, Int. J. Robot. Res. 11 (1992) 362). Mass and place therefore follow from the columns of these.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from rhythmid.body.body import BODY
from rhythmid.body.inertial_parameter import PAYLOAD
from rhythmid.body.link_inertia import point_mass
from rhythmid.diagnose.joints.joint_case import JointResult
from rhythmid.diagnose.joints.link_evidence import own_path, weight_of_values, with_body_of
from rhythmid.diagnose.rejections import decisive
from rhythmid.identify.inverse_dynamics.estimate import fit_effort
from rhythmid.identify.joints.joint_motion import JointBalances
from rhythmid.identify.least_squares import orthonormal
from rhythmid.identify.student import autocorrelation_time, scale_of, weights_of
from rhythmid.model import Model
from rhythmid.record.joint_record import JointRecord

Array = NDArray[np.float64]
BESIDE = 0.1  # [m] standard deviation of a payload's place about the end of its link: the size of a gripper or of a foot
ROUNDS = 3  # alternating fits of the paths and of the payload; the payload converges in two


@dataclass(frozen=True, eq=False)
class PlacedPayload:
    """Mass [kg] of a payload and its place (3,) [m] in the frame of its link, with standard deviations."""

    mass: float
    mass_std: float
    place: Array
    place_std: Array


@dataclass(frozen=True, eq=False)
class Rows:
    """The data of one joint: residual (n,), columns (n, 10) of the link's inertia, columns (n, p) of the other parameters."""

    residual: Array
    columns: Array
    beside: Array
    record: NDArray[np.int64]


def placed_payload(
    balances: JointBalances,
    records: Sequence[JointRecord],
    found: Mapping[str, JointResult],
    link: str,
    shown_at: str,
) -> PlacedPayload:
    """Mass and place of the payload of a link; `shown_at` is the joint whose search found it.

    All paths are refitted together with the payload. Effects and values that were found may only have stood for the payload. So the
    paths are the given ones; at the joint `shown_at` what was found, and at the others, too, where this has decisively more evidence.
    """
    given = {joint: balances.models[joint] for joint in found}
    effects = {joint: own_path(balances, one) for joint, one in found.items()}
    chosen = found[shown_at].result.chosen.model
    start = chosen.value(f"{BODY}.{link}.{PAYLOAD}")
    made = [
        _fitted(balances, records, found, link, shown_at, paths, start)
        for paths in (given, {**given, shown_at: chosen}, {**effects, shown_at: chosen})
    ]
    best, evidence = made[0]
    for richer, more in made[1:]:
        if more > evidence + decisive(1):
            best, evidence = richer, more
    return best


def _fitted(
    balances: JointBalances,
    records: Sequence[JointRecord],
    found: Mapping[str, JointResult],
    link: str,
    shown_at: str,
    paths: Mapping[str, Model],
    start: float,
) -> tuple[PlacedPayload, float]:
    """The payload fitted beside these paths from a `start` [kg], and the log odds that all joints give it."""
    machine, label = balances.machine, f"{BODY}.{link}.{PAYLOAD}"
    end = machine.body.ends[link]
    value, std = np.concatenate([[start], end]), np.zeros(4)

    def carried() -> JointBalances:
        return JointBalances.of(machine.with_payload(link, float(value[0]), value[1:]), records, balances)

    now = carried()
    for _ in range(ROUNDS):
        rows = []
        for joint in (one for one in found if f"{link}.{PAYLOAD}" in now.links(one)):
            model = with_body_of(now, joint, paths[joint], kept=joint == shown_at)
            held = model.with_parameters({label: now.models[joint].parameters[label]})
            rows.append(rows_of(now, joint, held, found[joint].late, link))
        value, std = _refined(rows, value, end)
        now = carried()
    payload = PlacedPayload(float(value[0]), float(std[0]), value[1:], std[1:])
    return payload, weight_of_values(found, balances, now, list(found))


def _refined(rows: Sequence[Rows], value: Array, end: Array) -> tuple[Array, Array]:
    """Improved mass and place (4,) from a start `value`, and their standard deviations."""
    weighted = [weighted_rows(one) for one in rows]
    before = value[0] * point_mass(value[1:])

    def error(at: Array) -> Array:
        change = at[0] * point_mass(at[1:]) - before
        return np.concatenate(
            [*(left + columns @ change for left, columns in weighted), (at[1:] - end) / BESIDE]
        )

    low = np.array([0.0, *(3 * [-np.inf])])
    solved = least_squares(error, value, bounds=(low, np.inf), x_scale="jac")
    return solved.x, np.sqrt(np.diag(np.linalg.pinv(solved.jac.T @ solved.jac)))


def rows_of(balances: JointBalances, joint: str, model: Model, late: float, link: str) -> Rows:
    """The data of a joint with its path fitted, and the columns of a link."""
    body = balances.machine.body
    own = body.joints[joint].velocity
    balance = balances.balance(joint, late)
    fit = fit_effort(balance, model)
    made = [body.inertial_columns(link, b.pose, b.rate, b.acceleration)[:, own] for b in balances.bodies]
    columns = balance.rows(made, balance.later(fit.model, fit.alignment))
    return Rows(fit.residual, columns, fit.jacobian, balance.record)


def weighted_rows(one: Rows, noise: Array | None = None) -> tuple[Array, Array]:
    """Residual and columns of a joint in units of its noise, with the joint's other parameters projected out.

    The `noise` (n,) is the residual itself unless that of a better model is given.
    """
    noise = one.residual if noise is None else noise
    scale = scale_of(noise)
    lasts = autocorrelation_time(noise, one.record)
    root = np.sqrt(weights_of(noise, scale) / lasts) / scale
    basis = orthonormal(one.beside * root[:, None])

    def without(signal: Array) -> Array:
        return signal - basis @ (basis.T @ signal)

    return without(root * one.residual), without(root[:, None] * one.columns)
