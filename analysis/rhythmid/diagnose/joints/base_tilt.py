"""A base that is tilted against its file: the direction of gravity as one cause that all joints share.

The efforts are linear in the acceleration of gravity in the frame of the base (M. Gautier, W. Khalil, Int. J. Robot. Res. 11 (1992) 362). Its
size is known, so that two angles are left, which all joints together determine. They compete with the laws of the joints, such as a
pendulum's gravity or a spring, which each joint needs for itself where the base is tilted.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from rhythmid.body.robot_file import FREE
from rhythmid.diagnose.answer.result import Estimate
from rhythmid.diagnose.constants import CONTRADICTS, HOLDS, PRACTICAL_EFFORT
from rhythmid.diagnose.joints.joint_case import PROMISING, JointResult
from rhythmid.diagnose.joints.link_evidence import gain_of, parts_of, with_body_of
from rhythmid.diagnose.joints.payload_place import ROUNDS, in_units_of_noise
from rhythmid.diagnose.rejections import decisive
from rhythmid.identify.inverse_dynamics.balance import Balance
from rhythmid.identify.inverse_dynamics.estimate import EffortFit, fit_effort, variation_of
from rhythmid.identify.joints.joint_motion import JointBalances
from rhythmid.model import Model
from rhythmid.record.joint_record import JointRecord
from rhythmid.report.quantity import with_std

Array = NDArray[np.float64]
WeightedRows = tuple[Array, Array]  # residual (n,) and columns (n, 3) of a joint, in units of its noise
# [rad] prior standard deviation of an angle that is not known at all: that of a uniform angle
ANY = math.pi / math.sqrt(3.0)
# [rad] standard deviation from which an angle is not determined: no tilt, of up to a right angle, would then contradict the file
UNDETERMINED = 0.5 * math.pi / CONTRADICTS
ANGLES = 2  # of a direction
TURNS = 20  # most changes between the best tilt and the best hypotheses beside it; three settle it


@dataclass(frozen=True, eq=False)
class BaseTilt:
    """The direction of gravity in the frame of the base as it fits the efforts of all joints.

    `angles` (k,) [rad] are rotations of gravity towards the `directions` (k, 3), unit vectors across the file's `given` gravity (3,) [m/s^2],
    with their `covariance` (k, k); k is 1 where the efforts do not say of the other direction, and `open` (3,) is that direction.
    `weight` is the log odds of all joints for it, `shown` the joint that shows it best.
    """

    given: Array
    directions: Array
    angles: Array
    covariance: Array
    open: Array | None
    weight: float
    shown: str = ""

    @property
    def gravity(self) -> Array:
        """Gravity (3,) [m/s^2] in the frame of the base."""
        return turned(self.given, self.directions, self.angles)

    @property
    def angle(self) -> Estimate:
        """The angle [deg] between this gravity and the file's."""
        size = float(np.linalg.norm(self.angles))
        slope = self.angles / size if size > 0.0 else np.zeros(len(self.angles))
        std = math.sqrt(max(float(slope @ self.covariance @ slope), 0.0))
        return Estimate(math.degrees(size), math.degrees(std), "deg")

    @property
    def moved(self) -> bool:
        """Whether the records contradict the file's direction."""
        angle = self.angle
        return angle.std is not None and angle.value > CONTRADICTS * angle.std

    @property
    def values(self) -> dict[str, Estimate]:
        """The angle, and the components of gravity, with no standard deviation where the records do not determine one."""
        slopes = _slopes(self.given, self.directions, self.angles)
        std = np.sqrt(np.maximum(np.diag(slopes @ self.covariance @ slopes.T), 0.0))
        found = {"angle": self.angle}
        for axis, value, spread, own in zip("xyz", self.gravity + 0.0, std, self._open(), strict=True):
            found[axis] = Estimate(float(value), None if own else float(spread), "m/s^2")
        return found

    def _open(self) -> NDArray[np.bool_]:
        """Components (3,) that a turn in the direction left open would change by more than the others are known."""
        return np.zeros(3, dtype=bool) if self.open is None else np.abs(self.open) > math.sin(UNDETERMINED)

    @property
    def probability(self) -> float:
        """Probability that the base is tilted: from the odds, and from the chance that a name is right where all evidence is for it."""
        return HOLDS / (1.0 + math.exp(-self.weight))

    @property
    def words(self) -> str:
        """The tilt and what to write, as one clause."""
        angle = self.angle
        vector = ", ".join(f"{float(format(one, '.4g')):g}" for one in np.round(self.gravity, 3) + 0.0)
        said = f"the base is tilted by {with_std(angle.value, angle.std)}° (gravity [{vector}])"
        said += f"; write  gravity: [{vector}]  under 'body:' in model.yaml"
        if self.open is None:
            return said
        axis = ", ".join(f"{one:.2g}" for one in np.round(self.open, 2) + 0.0)
        return f"{said}; a tilt towards [{axis}] is not determined by these efforts"


def turned(given: Array, directions: Array, angles: Array) -> Array:
    """A gravity (3,) after a rotation by these angles (k,) [rad] towards unit vectors (k, 3) across it."""
    size, angle = float(np.linalg.norm(given)), float(np.linalg.norm(angles))
    if angle == 0.0:
        return given.copy()
    return math.cos(angle) * given + size * math.sin(angle) / angle * (angles @ directions)


def _slopes(given: Array, directions: Array, angles: Array) -> Array:
    """Derivative (3, k) of the turned gravity with respect to the angles."""
    step = 1e-6
    sides = [
        turned(given, directions, angles + one) - turned(given, directions, angles - one)
        for one in step * np.eye(len(angles))
    ]
    return np.array(sides).reshape(len(angles), 3).T / (2.0 * step)


def likely_tilt(
    balances: JointBalances, records: Sequence[JointRecord], found: Mapping[str, JointResult]
) -> BaseTilt | None:
    """The tilt of the base that all joints together give decisively more than the laws found at each of them; None without one.

    A tilt is one cause: it has to be worth what one effect of the search costs, and the odds of each of its angles. What it explains at
    some joint has to be of practical size.
    """
    body = balances.machine.body
    size = float(np.linalg.norm(body.gravity))
    if body.base == FREE or size == 0.0 or not found:
        return None
    weights = weights_per_unit(balances)
    rows = [
        _rows(one.result.search.balance, one.result.nominal.fit, weights[joint])
        for joint, one in found.items()
    ]
    directions, undetermined = directions_of(rows, body.gravity)
    if not len(directions):
        return None
    if _gained(rows, body.gravity, directions) < PROMISING:
        return None
    price = max(decisive(one.result.contest.candidates) for one in found.values()) + decisive(1) * len(
        directions
    )
    options = {joint: _options(one, weights[joint]) for joint, one in found.items()}
    made = []
    for paths in (
        {joint: balances.models[joint] for joint in found},
        _best_beside(options, size * directions),
    ):
        one = replace(_fitted(balances, found, paths, weights, directions), open=undetermined)
        now = JointBalances.of(balances.machine.with_gravity(one.gravity), records, balances)
        made.append(_weighed(one, balances, now, found))
    plain, richer = made
    tilt = richer if richer.weight > plain.weight + decisive(1) else plain
    if not tilt.moved:
        return None
    return tilt if tilt.weight > price and _matters(tilt, balances, found, weights) else None


def weights_per_unit(balances: JointBalances) -> dict[str, list[Array]]:
    """By joint, the effort (n, 3) along each motion that one m/s^2 of gravity along each axis asks for."""
    body = balances.machine.body
    found: dict[str, list[Array]] = {joint: [] for joint in balances.models}
    without = body.with_gravity(np.zeros(3))
    along = [body.with_gravity(axis) for axis in np.eye(3)]
    for motion in balances.bodies:
        still = np.zeros_like(motion.rate)
        rest = without.inverse(motion.pose, still, still)
        columns = np.stack([one.inverse(motion.pose, still, still) - rest for one in along], axis=2)
        for joint, made in found.items():
            made.append(columns[:, body.joints[joint].velocity])
    return found


def _rows(
    balance: Balance, fit: EffortFit, weight: Sequence[Array], noise: Array | None = None
) -> WeightedRows:
    """What a fitted path leaves of the effort, and the effort (n, 3) per unit of gravity, in units of the noise."""
    columns = balance.rows(weight, balance.later(fit.model, fit.alignment))
    return in_units_of_noise(fit.residual, columns, fit.jacobian, balance.record, noise)


def directions_of(rows: Sequence[WeightedRows], given: Array) -> tuple[Array, Array | None]:
    """The directions (k, 3) across gravity in which the efforts determine a tilt, and the one in which they do not, if there is one."""
    size = float(np.linalg.norm(given))
    _, _, axes = np.linalg.svd(given[None, :] / size)
    across = axes[1:]
    information = np.zeros((ANGLES, ANGLES))
    for _, columns in rows:
        own = size * columns @ across.T
        information += own.T @ own
    values, turns = np.linalg.eigh(information)
    known = values > UNDETERMINED**-2
    directions = turns.T @ across
    missing = directions[~known]
    return directions[known], missing[0] if len(missing) == 1 else None


def _gained(rows: Sequence[WeightedRows], given: Array, directions: Array) -> float:
    """Gain of log likelihood of a small tilt beside the given paths, to first order."""
    size = float(np.linalg.norm(given))
    normal, slope = np.zeros((len(directions), len(directions))), np.zeros(len(directions))
    for left, columns in rows:
        own = size * columns @ directions.T
        normal += own.T @ own
        slope += own.T @ left
    return 0.5 * float(slope @ np.linalg.solve(normal + np.eye(len(slope)) / ANY**2, slope))


@dataclass(frozen=True, eq=False)
class _Option:
    """A hypothesis of a joint, what it leaves beside any gravity, as a triangle (r, 4) of columns and residual, and what its effects cost."""

    model: Model
    triangle: Array
    price: float

    def cost(self, change: Array) -> float:
        """Negative log likelihood, with the price, under a `change` (3,) of gravity [m/s^2]."""
        left = self.triangle @ np.append(change, 1.0)
        return 0.5 * float(left @ left) + self.price


def _options(one: JointResult, weight: Sequence[Array]) -> list[_Option]:
    """The hypotheses that a tilt may leave at a joint, in units of the noise beside the chosen one."""
    noise, price = one.result.chosen.fit.residual, decisive(one.result.contest.candidates)
    made = []
    for part in parts_of(one):
        left, columns = _rows(one.result.search.balance, part.fit, weight, noise)
        triangle: Array = np.asarray(np.linalg.qr(np.column_stack([columns, left]), mode="r"))
        made.append(_Option(part.fit.model, triangle, price * len(part.elements)))
    return made


def _best_beside(options: Mapping[str, list[_Option]], across: Array) -> dict[str, Model]:
    """The path of each joint that is best beside the best tilt along `across` (k, 3) [m/s^2 per rad], to first order.

    Tilt and paths are chosen in turn, from the tilt that each hypothesis alone gives: a law of a joint that stands for the tilt would hide it.
    """

    def tilt_of(chosen: Sequence[_Option]) -> Array:
        rows = np.concatenate(
            [one.triangle[:, :3] @ across.T for one in chosen] + [np.eye(len(across)) / ANY]
        )
        left = np.concatenate([one.triangle[:, 3] for one in chosen] + [np.zeros(len(across))])
        return np.asarray(-np.linalg.lstsq(rows, left, rcond=None)[0], dtype=np.float64)

    best: tuple[float, list[_Option]] | None = None
    for start in (one for some in options.values() for one in some):
        angles, chosen = tilt_of([start]), []
        for _ in range(TURNS):
            change, known = angles @ across, chosen
            chosen = [min(some, key=lambda one: one.cost(change)) for some in options.values()]
            angles = tilt_of(chosen)
            if chosen == known:
                break
        cost = sum(one.cost(angles @ across) for one in chosen)
        if best is None or cost < best[0]:
            best = cost, chosen
    assert best is not None  # each joint has its nominal path
    return {joint: one.model for joint, one in zip(options, best[1], strict=True)}


def _fitted(
    balances: JointBalances, found: Mapping[str, JointResult], paths: Mapping[str, Model], weights: Mapping[str, list[Array]],
    directions: Array,
) -> BaseTilt:  # fmt: skip
    """The tilt that fits best beside these paths; paths and tilt are fitted in turn."""
    given = balances.machine.body.gravity
    angles, covariance = np.zeros(len(directions)), np.eye(len(directions))
    for _ in range(ROUNDS):
        gravity = turned(given, directions, angles)
        weighted = []
        for joint, one in found.items():
            balance = pulled(balances, joint, weights, gravity - given).balance(joint, one.late)
            model = with_body_of(balances.models[joint], paths[joint])
            weighted.append(_rows(balance, fit_effort(balance, model), weights[joint]))
        angles, covariance = _refined(weighted, given, directions, angles)
    return BaseTilt(given, directions, angles, covariance, None, 0.0)


def pulled(
    balances: JointBalances, joint: str, weights: Mapping[str, list[Array]], change: Array
) -> JointBalances:
    """The balances with another gravity at one joint, by this `change` (3,) [m/s^2]; columns of links are left as they are."""
    made = [
        motion if motion.coupling is None else replace(motion, coupling=motion.coupling + weight @ change)
        for motion, weight in zip(balances.motions[joint], weights[joint], strict=True)
    ]
    return replace(balances, motions={**balances.motions, joint: made})


def _refined(
    rows: Sequence[WeightedRows], given: Array, directions: Array, start: Array
) -> tuple[Array, Array]:
    """Improved angles (k,) from a `start` (k,), and their covariance (k, k); `rows` are residuals and columns in units of the noise."""
    triangles = [np.linalg.qr(np.column_stack([columns, left]), mode="r") for left, columns in rows]
    before = turned(given, directions, start)

    def error(at: Array) -> Array:
        change = np.append(turned(given, directions, at) - before, 1.0)
        return np.concatenate([*(triangle @ change for triangle in triangles), at / ANY])

    solved = least_squares(error, start)
    noise = np.linalg.pinv(solved.jac.T @ solved.jac)
    # each joint has unmodelled effects of its own; what its optimum is apart from that of all widens the errors (K.-Y. Liang, S. L. Zeger,
    # Biometrika 73 (1986) 13)
    ends = np.cumsum([len(triangle) for triangle in triangles])
    parts = [slice(end - len(triangle), end) for triangle, end in zip(triangles, ends, strict=True)]
    apart = noise @ np.column_stack([solved.jac[part].T @ solved.fun[part] for part in parts])
    return solved.x, noise + apart @ apart.T


def _weighed(
    tilt: BaseTilt, before: JointBalances, after: JointBalances, found: Mapping[str, JointResult]
) -> BaseTilt:
    """The tilt with the log odds of all joints, and the joint that shows it best."""
    gains: dict[str, float] = {}
    for joint, one in found.items():
        sides = ((side.models[joint], side.balance(joint, one.late)) for side in (before, after))
        gains[joint] = gain_of(one, parts_of(one), *sides)
    shown = max(gains, key=lambda joint: gains[joint])
    return replace(tilt, weight=sum(gains.values()), shown=shown)


def _matters(
    tilt: BaseTilt,
    balances: JointBalances,
    found: Mapping[str, JointResult],
    weights: Mapping[str, list[Array]],
) -> bool:
    """Whether the tilt changes the effort of some joint by a practical size, beyond what the joint's path explains by itself."""
    for joint, one in found.items():
        balance = pulled(balances, joint, weights, tilt.gravity - tilt.given).balance(joint, one.late)
        left = fit_effort(balance, balances.models[joint]).error
        removed = one.result.nominal.fit.error**2 - left**2
        if math.sqrt(max(removed, 0.0)) > PRACTICAL_EFFORT * variation_of(balance):
            return True
    return False
