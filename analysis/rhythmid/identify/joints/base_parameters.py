"""Inertial parameters of all links from the efforts of all joints.

Inverse dynamics is linear in the ten parameters of each link, but no motion identifies all of them. Only as many
combinations are identifiable, the base parameters, as the regressor has rank (M. Gautier, IFAC Proc. 23 (1990) 455:
QR with pivoting). Physically consistent link parameters are found as those nearest to the file's values with the
same fit. The pseudo-inertia of each link is a Cholesky product and therefore stays positive definite (C. Rucker, P.
M. Wensing, IEEE Robot. Autom. Lett. 7 (2022) 2716; P. M. Wensing, S. Kim, J.-J. E. Slotine, IEEE Robot. Autom.
Lett. 3 (2018) 60).
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import qr

from rhythmid.identify.inverse_dynamics.balance import Balance
from rhythmid.identify.inverse_dynamics.estimate import EffortFit, linearise
from rhythmid.identify.joints.joint_motion import JointBalances
from rhythmid.identify.least_squares import orthonormal

Array = NDArray[np.float64]
NAMES = ("m", "mx", "my", "mz", "Ixx", "Iyy", "Izz", "Ixy", "Ixz", "Iyz")
UNITS = ("kg", *("kg*m",) * 3, *("kg*m^2",) * 6)
# share of the scaled regressor's largest singular value below which a combination is not identifiable
SEEN = 1e-6
TOLD = 0.05  # coefficient of a combination below which a parameter is not listed
# standard deviation of the logarithm of a link's sizes relative to the file's: a factor of 1.6 either way
SPREAD = 0.5
PASSES = 12  # Gauss-Newton iterations
SAME = 1e-9  # relative change of the cost at which the iterations end


@dataclass(frozen=True)
class BaseParameter:
    """An identifiable combination of inertial parameters: that of `name`, and the further ones by name with their
    factors."""

    name: str
    value: float
    std: float
    unit: str
    beside: Mapping[str, float]


@dataclass(frozen=True)
class InertialEstimate:
    """Base parameters, and for each link ten physically consistent parameters. `rank` of `count` combinations are
    identifiable; `condition` is the condition number of their scaled columns."""

    base: tuple[BaseParameter, ...]
    links: Mapping[str, Mapping[str, float]]
    rank: int
    count: int
    condition: float


def estimate_inertia(
    balances: JointBalances, fits: Mapping[str, tuple[Balance, EffortFit]]
) -> InertialEstimate:
    """Inertial parameters together with the path of each joint. The paths were fitted as in `fits`; their free
    parameters are refitted."""
    body = balances.machine.body
    links = list(body.links)
    given = np.concatenate([body.inertial(link) for link in links])
    sizes = np.concatenate([_sizes(body.inertial(link)) for link in links])
    columns = [
        np.concatenate(
            [body.inertial_columns(link, one.pose, one.rate, one.acceleration) for link in links], axis=2
        )
        for one in balances.bodies
    ]
    parts, targets = [], []
    for joint, (balance, fit) in fits.items():
        own = body.joints[joint].velocity
        shift = balance.later(fit.model, fit.alignment)
        made = balance.rows([np.ascontiguousarray(one[:, own]) for one in columns], shift) * sizes
        residual, jacobian = linearise(balance, fit.model, _paths(fit), fit.alignment)
        left = _without(np.column_stack([made, residual]), jacobian) / (fit.scale * np.sqrt(fit.correlation))
        parts.append(left[:, :-1])
        targets.append(-left[:, -1])
    matrix, target = np.vstack(parts), np.concatenate(targets)
    triangle: Array = np.asarray(np.linalg.qr(np.column_stack([matrix, target]), mode="r"))
    matrix, target = triangle[:, :-1], triangle[:, -1]
    estimate = _consistent(matrix, target, given, sizes, len(links))
    base, rank, condition = _base(matrix, target, given, sizes, links)
    found: dict[str, dict[str, float]] = {
        link: dict(zip(NAMES, estimate[10 * k : 10 * k + 10].tolist(), strict=True))
        for k, link in enumerate(links)
    }
    return InertialEstimate(tuple(base), found, rank, len(given), condition)


def _paths(fit: EffortFit) -> tuple[str, ...]:
    """The fitted parameters of the joint's path, without those of the body."""
    return tuple(name for name in fit.names if not name.startswith("body."))


def _without(values: Array, nuisance: Array) -> Array:
    """Residual of values (n, p) after a least-squares fit of the nuisance columns."""
    basis = orthonormal(nuisance)
    return values - basis @ (basis.T @ values)


def _sizes(inertial: Array) -> Array:
    """Scales of a link's parameters: its mass, and the mass times its radius of gyration and times the square of that."""
    mass = inertial[0]
    radius = np.sqrt(max(float(inertial[4:7].sum()) / (2.0 * mass), 1e-12))
    return mass * np.array([1.0, *(radius,) * 3, *(radius**2,) * 6])


def _base(
    matrix: Array, target: Array, given: Array, sizes: Array, links: list[str]
) -> tuple[list[BaseParameter], int, float]:
    names = [f"{link}.{name}" for link in links for name in NAMES]
    units = UNITS * len(links)
    made: Any = qr(matrix, mode="economic", pivoting=True)
    _, triangle, pivots = made
    diagonal = np.abs(np.diag(triangle))
    rank = int(np.sum(diagonal > SEEN * diagonal[0]))
    first, rest = pivots[:rank], pivots[rank:]
    factors = np.linalg.solve(triangle[:rank, :rank], triangle[:rank, rank:])
    columns = matrix[:, first]
    change, *_ = np.linalg.lstsq(columns, target, rcond=None)
    spread = np.sqrt(np.diag(np.linalg.pinv(columns.T @ columns)))
    before = given[first] / sizes[first] + factors @ (given[rest] / sizes[rest])
    found = []
    for place, number in enumerate(first):
        beside = {
            names[other]: float(factors[place, k] * sizes[number] / sizes[other])
            for k, other in enumerate(rest)
            if abs(factors[place, k]) > TOLD
        }
        value = float((before[place] + change[place]) * sizes[number])
        found.append(
            BaseParameter(names[number], value, float(spread[place] * sizes[number]), units[number], beside)
        )
    values = np.linalg.svd(columns / np.linalg.norm(columns, axis=0), compute_uv=False)
    return sorted(found, key=lambda one: one.name), rank, float(values[0] / values[-1])


def _consistent(matrix: Array, target: Array, given: Array, sizes: Array, count: int) -> Array:
    """Physically consistent parameters (10 links,) near those given: least squares with a prior on the logarithms
    of their sizes."""
    start = np.concatenate([to_cholesky(given[10 * k : 10 * k + 10]) for k in range(count)])
    scale = np.concatenate([_spread(start[10 * k : 10 * k + 10]) for k in range(count)])
    value = start.copy()

    def parameters(at: Array) -> Array:
        return np.concatenate([from_cholesky(at[10 * k : 10 * k + 10]) for k in range(count)])

    def errors(at: Array) -> Array:
        change = (parameters(at) - given) / sizes
        return np.concatenate([matrix @ change - target, (at - start) / scale])

    cost = float(np.sum(errors(value) ** 2))
    for _ in range(PASSES):
        slopes = np.zeros((10 * count, 10 * count))
        for k in range(count):
            part = slice(10 * k, 10 * k + 10)
            for one in range(10):
                moved = value[part].copy()
                step = 1e-6 * scale[10 * k + one]
                moved[one] += step
                slopes[part, 10 * k + one] = (from_cholesky(moved) - from_cholesky(value[part])) / step
        jacobian = np.vstack([matrix @ (slopes / sizes[:, None]), np.diag(1.0 / scale)])
        step, *_ = np.linalg.lstsq(jacobian, -errors(value), rcond=None)
        share = 1.0
        while share > 1e-3 and not float(np.sum(errors(value + share * step) ** 2)) < cost:
            share *= 0.5
        better = float(np.sum(errors(value + share * step) ** 2))
        if not better < cost:
            break
        value, gained, cost = value + share * step, cost - better, better
        if gained < SAME * cost:
            break
    return parameters(value)


def _spread(cholesky: Array) -> Array:
    """Standard deviations of the factors' entries: of the logarithms on the diagonal; below it, shares of the
    diagonal."""
    size = np.exp(cholesky[:4])
    rows = np.array([1, 2, 2, 3, 3, 3])
    return np.concatenate([np.full(4, SPREAD), SPREAD * size[rows]])


def to_cholesky(inertial: Array) -> Array:
    """Logarithms of the diagonal (4) and the entries below it (6) of the factor of a link's pseudo-inertia.

    Raises numpy.linalg.LinAlgError for parameters that are not physically consistent.
    """
    mass, centre = inertial[0], inertial[1:4]
    ixx, iyy, izz, ixy, ixz, iyz = inertial[4:]
    about = np.array([[ixx, ixy, ixz], [ixy, iyy, iyz], [ixz, iyz, izz]])
    second = 0.5 * np.trace(about) * np.eye(3) - about
    whole = np.block([[np.array([[mass]]), centre[None, :]], [centre[:, None], second]])
    tiny = (
        1e-9 * np.trace(second) * np.diag([0.0, 1.0, 1.0, 1.0])
    )  # a point or a rod has no second moments in some directions
    factor = np.linalg.cholesky(whole + tiny)
    return np.concatenate([np.log(np.diag(factor)), factor[np.tril_indices(4, -1)]])


def from_cholesky(entries: Array) -> Array:
    """The ten parameters of a link from the factor of its pseudo-inertia."""
    factor = np.diag(np.exp(entries[:4]))
    factor[np.tril_indices(4, -1)] = entries[4:]
    whole = factor @ factor.T
    second = whole[1:, 1:]
    about = np.trace(second) * np.eye(3) - second
    return np.concatenate([[whole[0, 0]], whole[0, 1:], np.diag(about), about[[0, 0, 1], [1, 2, 2]]])
