"""Place of a payload in the frame of its link, and its mass, from the efforts of all joints that feel it.

The search assumes a point mass at the end of the link. The centre of a gripper or a foot is close to this point but not at it; the
remaining mismatch would be attributed to a wrong mass or rotor. The force of a point mass is linear in its mass, its first moment and
its inertia (M. Gautier, W. Khalil, Int. J. Robot. Res. 11 (1992) 362). Mass and place therefore follow from the columns of these.
"""

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from rhythmid.body.body import BODY
from rhythmid.body.inertial_parameter import MASS, PAYLOAD
from rhythmid.body.link_inertia import point_mass
from rhythmid.diagnose.answer.result import Estimate
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
AXES = ("x", "y", "z")
BESIDE = 0.1  # [m] standard deviation of a payload's place about the end of its link: the size of a gripper or of a foot
ROUNDS = 3  # alternating fits of the paths and of the payload; the payload converges in two


def placed_payload(
    balances: JointBalances,
    records: Sequence[JointRecord],
    found: Mapping[str, JointResult],
    link: str,
    shown_at: str,
) -> dict[str, Estimate]:
    """Mass [kg] of the payload of a link, and its place "x", "y", "z" [m] in the frame of the link; `shown_at` is the joint whose search found it.

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
) -> tuple[dict[str, Estimate], float]:
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
            model = with_body_of(now.models[joint], paths[joint], kept=joint == shown_at)
            held = model.with_parameters({label: now.models[joint].parameters[label]})
            rows.append(weighted_rows(now, joint, held, found[joint].late, link))
        value, std = _refined(rows, value, end)
        now = carried()
    units = zip((MASS, *AXES), value, std, ("kg", "m", "m", "m"), strict=True)
    payload = {name: Estimate(float(one), float(its), unit) for name, one, its, unit in units}
    return payload, weight_of_values(found, balances, now, list(found))


def _refined(rows: Sequence[tuple[Array, Array]], value: Array, end: Array) -> tuple[Array, Array]:
    """Improved mass and place (4,) from a start `value`, and their standard deviations; `rows` as `weighted_rows` gives them."""
    before = value[0] * point_mass(value[1:])

    def error(at: Array) -> Array:
        change = at[0] * point_mass(at[1:]) - before
        return np.concatenate([*(left + columns @ change for left, columns in rows), (at[1:] - end) / BESIDE])

    low = np.array([0.0, *(3 * [-np.inf])])
    solved = least_squares(error, value, bounds=(low, np.inf), x_scale="jac")
    return solved.x, np.sqrt(np.diag(np.linalg.pinv(solved.jac.T @ solved.jac)))


def weighted_rows(
    balances: JointBalances, joint: str, model: Model, late: float, link: str
) -> tuple[Array, Array]:
    """Residual (n,) of a joint with its path fitted, and columns (n, 10) of the inertia of a link, in units of the joint's noise.

    The other parameters of the joint are projected out.
    """
    body = balances.machine.body
    own = body.joints[joint].velocity
    balance = balances.balance(joint, late)
    fit = fit_effort(balance, model)
    made = [body.inertial_columns(link, b.pose, b.rate, b.acceleration)[:, own] for b in balances.bodies]
    columns = balance.rows(made, balance.later(fit.model, fit.alignment))
    return in_units_of_noise(fit.residual, columns, fit.jacobian, balance.record)


def in_units_of_noise(
    residual: Array, columns: Array, beside: Array, record: NDArray[np.int64], noise: Array | None = None
) -> tuple[Array, Array]:
    """A residual (n,) and columns (n, k) in units of the noise, with the columns `beside` (n, p) of other parameters projected out.

    The `noise` (n,) is the residual itself unless that of a better model is given; `record` (n,) is the record of each row.
    """
    noise = residual if noise is None else noise
    scale = scale_of(noise)
    lasts = autocorrelation_time(noise, record)
    root = np.sqrt(weights_of(noise, scale) / lasts) / scale
    basis = orthonormal(beside * root[:, None])

    def without(signal: Array) -> Array:
        return signal - basis @ (basis.T @ signal)

    return without(root * residual), without(root[:, None] * columns)
