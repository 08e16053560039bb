"""A cause of the machine as a whole: a few numbers that change the efforts of several joints, fitted to all of them together.

Such a cause competes with the laws that each joint would need for itself where the machine has it. It has to be worth what one effect of
the search costs, and the odds of each of its numbers; and what it explains at some joint has to be of practical size.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from rhythmid.diagnose.constants import HOLDS, PRACTICAL_EFFORT
from rhythmid.diagnose.joints.joint_case import PROMISING, JointResult
from rhythmid.diagnose.joints.link_evidence import gain_of, parts_of, with_body_of
from rhythmid.diagnose.joints.payload_place import in_units_of_noise
from rhythmid.diagnose.rejections import decisive
from rhythmid.identify.inverse_dynamics.balance import Balance
from rhythmid.identify.inverse_dynamics.estimate import EffortFit, fit_effort, variation_of
from rhythmid.identify.joints.joint_motion import JointBalances
from rhythmid.model import Model

Array = NDArray[np.float64]
Columns = dict[str, list[Array]]  # by joint and motion, changes (n, p) of the effort
WeightedRows = tuple[Array, Array]  # residual (n,) and columns (n, p) of a joint, in units of its noise
# most fits of paths and numbers in turn, and the change of each number, in its standard deviations, from which they have settled. A tilt
# settles in three; the compliance of a gear moves all paths, and took ten (three left it six standard deviations off)
MOST_ROUNDS, SETTLED = 12, 0.2
TURNS = 20  # most changes between the best cause and the best hypotheses beside it; three settle it


class Cause(Protocol):
    """A cause with k numbers, of which p coordinates, such as the components of gravity, change the efforts linearly."""

    @property
    def spreads(self) -> Array:
        """Prior standard deviations (k,) of the numbers, where nothing is known of them."""
        ...

    @property
    def least(self) -> float:
        """Least value of each number."""
        ...

    @property
    def slopes(self) -> Array:
        """Derivatives (k, p) of the coordinates with respect to the numbers, where these are zero."""
        ...

    def coordinates(self, numbers: Array) -> Array:
        """The coordinates (p,) beyond those of the machine as it is, for these numbers (k,)."""
        ...

    def imposed(self, numbers: Array, paths: Mapping[str, Model]) -> JointBalances:
        """The balances with these numbers, while the joints have these paths."""
        ...

    def columns(self, now: JointBalances, numbers: Array, paths: Mapping[str, Model]) -> Columns:
        """Changes of the efforts per unit of each coordinate, about the balances with these numbers."""
        ...

    def in_place(self, numbers: Array, paths: Mapping[str, Model]) -> JointBalances:
        """The balances of the machine that has these numbers."""
        ...


@dataclass(frozen=True, eq=False)
class Weighed:
    """The numbers (k,) of a cause with their `covariance` (k, k), the `paths` of the joints that were fitted beside them, the log odds of all
    joints for it (`weight`), and the joint that shows it best (`shown`)."""

    numbers: Array
    covariance: Array
    paths: Mapping[str, Model]
    weight: float
    shown: str

    @property
    def probability(self) -> float:
        """Probability of the cause: from the odds, and from the chance that a name is right where all evidence is for it."""
        return HOLDS / (1.0 + math.exp(-self.weight))


def worth_it(
    cause: Cause, balances: JointBalances, found: Mapping[str, JointResult], judges: Sequence[str] = ()
) -> Weighed | None:
    """The cause, if all joints together give it decisively more than the laws found at each of them; None otherwise.

    Only the joints that are `judges`, by default all, estimate it. Another joint may speak against it.
    """
    weighing = {joint: one for joint, one in found.items() if not judges or joint in judges}
    columns = _columns(cause, balances, found)
    if first_gain(cause, columns, weighing) < PROMISING:
        return None
    options = {joint: _options(one, columns[joint]) for joint, one in weighing.items()}
    given = {joint: balances.models[joint] for joint in found}
    numbers, made = np.zeros(len(cause.spreads)), []
    for paths in (given, {**given, **_best_beside(options, cause)}):
        numbers, covariance, fitted = _fitted(cause, balances, found, paths, list(weighing), numbers)
        after = cause.in_place(numbers, fitted)
        made.append(_weighed(Weighed(numbers, covariance, fitted, 0.0, ""), balances, after, found, weighing))
    plain, richer = made
    best = richer if richer.weight > plain.weight + decisive(1) else plain
    price = max(decisive(one.result.contest.candidates) for one in found.values())
    if best.weight <= price + decisive(1) * len(best.numbers):
        return None
    return best if _matters(cause.imposed(best.numbers, best.paths), balances, weighing) else None


def _columns(cause: Cause, balances: JointBalances, found: Mapping[str, JointResult]) -> Columns:
    """Changes of the efforts per unit of each coordinate, about the machine as it is."""
    start = {joint: one.result.nominal.fit.model for joint, one in found.items()}
    return cause.columns(balances, np.zeros(len(cause.spreads)), start)


def most_promising(
    causes: Mapping[str, Cause], balances: JointBalances, found: Mapping[str, JointResult]
) -> str | None:
    """The joint of the cause, by joint, of which a small one would explain most of what the other joints' given paths leave; None where none does."""
    gains: dict[str, float] = {}
    for joint, cause in causes.items():
        others = {other: one for other, one in found.items() if other != joint}
        gains[joint] = first_gain(cause, _columns(cause, balances, found), others)
    best = max(gains, key=lambda joint: gains[joint], default=None)
    return None if best is None or gains[best] < PROMISING else best


def first_gain(cause: Cause, columns: Columns, found: Mapping[str, JointResult]) -> float:
    """Gain of log likelihood of a small cause beside the given paths of these joints, to first order."""
    rows = [
        rows_of(one.result.search.balance, one.result.nominal.fit, columns[joint])
        for joint, one in found.items()
    ]
    return _gained(rows, cause)


def rows_of(
    balance: Balance, fit: EffortFit, columns: Sequence[Array], noise: Array | None = None
) -> WeightedRows:
    """What a fitted path leaves of the effort, and the columns (n, p) of a cause, in units of the noise."""
    made = balance.rows(columns, balance.later(fit.model, fit.alignment))
    return in_units_of_noise(fit.residual, made, fit.jacobian, balance.record, noise)


def _gained(rows: Sequence[WeightedRows], cause: Cause) -> float:
    """Gain of log likelihood of a small cause beside the given paths, to first order."""
    slopes = cause.slopes
    normal, slope = np.zeros((len(slopes), len(slopes))), np.zeros(len(slopes))
    for left, columns in rows:
        own = columns @ slopes.T
        normal += own.T @ own
        slope += own.T @ left
    change = np.maximum(-np.linalg.solve(normal + np.diag(cause.spreads**-2), slope), cause.least)
    return -0.5 * float(slope @ change)


@dataclass(frozen=True, eq=False)
class _Option:
    """A hypothesis of a joint, what it leaves beside any cause, as a triangle (r, p + 1) of columns and residual, and what its effects cost."""

    model: Model
    triangle: Array
    price: float

    def cost(self, change: Array) -> float:
        """Negative log likelihood, with the price, under a `change` (p,) of the coordinates."""
        left = self.triangle @ np.append(change, 1.0)
        return 0.5 * float(left @ left) + self.price


def _options(one: JointResult, columns: Sequence[Array]) -> list[_Option]:
    """The hypotheses that a cause may leave at a joint, in units of the noise beside the chosen one."""
    noise, price = one.result.chosen.fit.residual, decisive(one.result.contest.candidates)
    made = []
    for part in parts_of(one):
        left, own = rows_of(one.result.search.balance, part.fit, columns, noise)
        triangle: Array = np.asarray(np.linalg.qr(np.column_stack([own, left]), mode="r"))
        made.append(_Option(part.fit.model, triangle, price * len(part.elements)))
    return made


def _best_beside(options: Mapping[str, list[_Option]], cause: Cause) -> dict[str, Model]:
    """The path of each joint that is best beside the best cause, to first order.

    Cause and paths are chosen in turn, from the cause that each hypothesis alone gives: a law of a joint that stands for the cause would hide it.
    """
    slopes = cause.slopes

    def best_with(chosen: Sequence[_Option]) -> Array:
        rows = [one.triangle[:, :-1] @ slopes.T for one in chosen] + [np.diag(1.0 / cause.spreads)]
        left = [one.triangle[:, -1] for one in chosen] + [np.zeros(len(slopes))]
        found = -np.linalg.lstsq(np.concatenate(rows), np.concatenate(left), rcond=None)[0]
        return np.maximum(np.asarray(found, dtype=np.float64), cause.least)

    best: tuple[float, list[_Option]] | None = None
    for start in (one for some in options.values() for one in some):
        numbers, chosen = best_with([start]), []
        for _ in range(TURNS):
            change, known = numbers @ slopes, chosen
            chosen = [min(some, key=lambda one: one.cost(change)) for some in options.values()]
            numbers = best_with(chosen)
            if chosen == known:
                break
        cost = sum(one.cost(numbers @ slopes) for one in chosen)
        if best is None or cost < best[0]:
            best = cost, chosen
    assert best is not None  # each joint has its nominal path
    return {joint: one.model for joint, one in zip(options, best[1], strict=True)}


def _fitted(
    cause: Cause, balances: JointBalances, found: Mapping[str, JointResult], paths: Mapping[str, Model], judges: Sequence[str],
    start: Array,
) -> tuple[Array, Array, dict[str, Model]]:  # fmt: skip
    """The numbers that fit best beside these paths, their covariance, and the fitted paths; paths and numbers are fitted in turn, from a
    `start` (k,) of the numbers, until they settle."""
    numbers, covariance = start, np.diag(cause.spreads**2)
    fitted = {
        joint: one.result.nominal.fit.model if paths[joint] is balances.models[joint] else paths[joint]
        for joint, one in found.items()
    }
    for _ in range(MOST_ROUNDS):
        before = numbers
        now = cause.imposed(numbers, fitted)
        fits = {
            joint: fit_effort(
                now.balance(joint, one.late), with_body_of(balances.models[joint], paths[joint])
            )
            for joint, one in found.items()
        }
        fitted = {joint: fit.model for joint, fit in fits.items()}
        columns = cause.columns(now, numbers, fitted)
        weighted = [
            rows_of(now.balance(joint, found[joint].late), fits[joint], columns[joint]) for joint in judges
        ]
        numbers, covariance = _refined(weighted, cause, before)
        if np.all(np.abs(numbers - before) <= SETTLED * np.sqrt(np.diag(covariance))):
            break
    return numbers, covariance, fitted


def _refined(rows: Sequence[WeightedRows], cause: Cause, start: Array) -> tuple[Array, Array]:
    """Improved numbers (k,) from a `start` (k,), and their covariance (k, k); `rows` are residuals and columns in units of the noise."""
    triangles = [np.linalg.qr(np.column_stack([columns, left]), mode="r") for left, columns in rows]
    before = cause.coordinates(start)

    def error(at: Array) -> Array:
        change = np.append(cause.coordinates(at) - before, 1.0)
        return np.concatenate([*(triangle @ change for triangle in triangles), at / cause.spreads])

    solved = least_squares(error, start, bounds=(cause.least, np.inf), x_scale=cause.spreads)
    noise = np.linalg.pinv(solved.jac.T @ solved.jac)
    # each joint has unmodelled effects of its own; what its optimum is apart from that of all widens the errors (K.-Y. Liang, S. L. Zeger,
    # Biometrika 73 (1986) 13)
    ends = np.cumsum([len(triangle) for triangle in triangles])
    parts = [slice(end - len(triangle), end) for triangle, end in zip(triangles, ends, strict=True)]
    apart = noise @ np.column_stack([solved.jac[part].T @ solved.fun[part] for part in parts])
    return solved.x, noise + apart @ apart.T


def _weighed(
    fit: Weighed, before: JointBalances, after: JointBalances, found: Mapping[str, JointResult], judges: Mapping[str, JointResult],
) -> Weighed:  # fmt: skip
    """The cause with the log odds of all joints, and the joint that shows it best."""
    gains: dict[str, float] = {}
    for joint, one in found.items():
        sides = ((side.models[joint], side.balance(joint, one.late)) for side in (before, after))
        gains[joint] = gain_of(one, parts_of(one), *sides)
    shown = max(judges, key=lambda joint: gains[joint])
    weight = sum(gain if joint in judges else min(gain, 0.0) for joint, gain in gains.items())
    return Weighed(fit.numbers, fit.covariance, fit.paths, weight, shown)


def _matters(now: JointBalances, before: JointBalances, found: Mapping[str, JointResult]) -> bool:
    """Whether the cause changes the effort of some joint by a practical size, beyond what the joint's path explains by itself."""
    for joint, one in found.items():
        balance = now.balance(joint, one.late)
        left = fit_effort(balance, before.models[joint]).error
        removed = one.result.nominal.fit.error**2 - left**2
        if math.sqrt(max(removed, 0.0)) > PRACTICAL_EFFORT * variation_of(balance):
            return True
    return False
