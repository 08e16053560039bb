"""A cause of the machine as a whole: a few numbers that change the efforts of several joints, fitted to all of them together.

Such a cause competes with the laws that each joint would need for itself where the machine has it. It has to be worth what one effect of
the search costs, and the odds of each of its numbers; and what it explains at some joint has to be of practical size.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from rhythmid.diagnose.constants import HOLDS, PRACTICAL_EFFORT, UNNAMED_EFFORT
from rhythmid.diagnose.effort.fitted import Fitted
from rhythmid.diagnose.joints.dry_friction import with_dry_friction
from rhythmid.diagnose.joints.joint_case import PROMISING, JointResult
from rhythmid.diagnose.joints.joint_rows import in_units_of_noise
from rhythmid.diagnose.joints.link_evidence import gain_of, laws_of, parts_of, with_body_of
from rhythmid.diagnose.rejections import decisive
from rhythmid.identify.inverse_dynamics.balance import Balance
from rhythmid.identify.inverse_dynamics.estimate import EffortFit, fit_effort, variation_of
from rhythmid.identify.joints.joint_motion import JointBalances
from rhythmid.identify.student import autocorrelation_time, scale_of
from rhythmid.model import Model

Array = NDArray[np.float64]
Columns = dict[str, list[Array]]  # by joint and motion, changes (n, p) of the effort
WeightedRows = tuple[Array, Array]  # residual (n,) and columns (n, p) of a joint, in units of its noise
# most fits of paths and numbers in turn, and the change of each number, in its standard deviations, from which they have settled. A tilt
# settles in three; the compliance of a gear moves all paths, and took ten (three left it six standard deviations off)
MOST_ROUNDS, SETTLED = 12, 0.2
TURNS = 20  # most changes between the best cause and the best hypotheses beside it; three settle it
SAME = 0.1  # [nat] change of the log likelihood from which they have settled
TINY = 1e-12  # least sum of squares, in units of the noise


class Numbers(Protocol):
    """The k numbers of a cause, of which p coordinates, such as the components of gravity, change the efforts linearly."""

    @property
    def spreads(self) -> Array:
        """Prior standard deviations (k,) of the numbers, where nothing is known of them."""
        ...

    @property
    def least(self) -> float | Array:
        """Least value of each number, or of all."""
        ...

    @property
    def slopes(self) -> Array:
        """Derivatives (k, p) of the coordinates with respect to the numbers, where these are zero."""
        ...

    def coordinates(self, numbers: Array) -> Array:
        """The coordinates (p,) beyond those of the machine as it is, for these numbers (k,)."""
        ...


class Cause(Numbers, Protocol):
    """A cause, and the balances of the machine that has it."""

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
    joints for it (`weight`), the joint that shows it best (`shown`), and what it explains of that joint's mismatch (`share`). `best` is the hypothesis of
    each joint that predicts best beside it."""

    numbers: Array
    covariance: Array
    paths: Mapping[str, Model]
    weight: float
    shown: str
    share: float
    best: Mapping[str, Fitted]

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
    options = {joint: options_of(one, columns[joint]) for joint, one in weighing.items()}
    beside = best_beside(options, cause).fits
    plain = weighed(cause, balances, found, weighing, np.zeros(len(cause.spreads)), {})
    richer = weighed(cause, balances, found, weighing, plain.numbers, beside)
    best = richer if richer.weight > plain.weight + decisive(1) else plain
    price = max(decisive(one.result.contest.candidates) for one in found.values())
    if best.weight <= price + decisive(1) * len(best.numbers):
        return None
    return best if matters(cause.imposed(best.numbers, best.paths), balances, weighing) else None


def weighed(
    cause: Cause, balances: JointBalances, found: Mapping[str, JointResult], judges: Mapping[str, JointResult], start: Array,
    beside: Mapping[str, Fitted], rivals: Callable[[JointResult], list[Fitted]] = parts_of,
) -> Weighed:  # fmt: skip
    """The cause fitted from a `start` (k,) beside the given path of each joint, or beside that of a hypothesis, with the log odds of all joints for it.

    With and without the cause each joint has the best of its `rivals` and of the hypothesis beside the cause.
    """
    paths = {joint: beside[joint].fit.model if joint in beside else balances.models[joint] for joint in found}
    numbers, covariance, fitted = _fitted(cause, balances, found, paths, list(judges), start)
    gains: dict[str, float] = {}
    best: dict[str, Fitted] = {}
    after = cause.in_place(numbers, fitted)
    for joint, one in found.items():
        sides = ((side.models[joint], side.balance(joint, one.late)) for side in (balances, after))
        parts = rivals(one)
        parts += [beside[joint]] if joint in beside and beside[joint] not in parts else []
        gains[joint], best[joint] = gain_of(one, parts, *sides)
    shown = max(judges, key=lambda joint: gains[joint])
    weight = sum(gain if joint in judges else min(gain, 0.0) for joint, gain in gains.items())
    share = _share(found[shown], balances, after, fitted[shown])
    return Weighed(numbers, covariance, fitted, weight, shown, share, best)


def _share(one: JointResult, before: JointBalances, after: JointBalances, path: Model) -> float:
    """Share of a joint's mismatch that a cause explains beside the given path, or beside a fitted `path` where its effects hide it."""
    whole, removed = one.result.nominal.fit.error, 0.0
    for beside in (before.models[one.joint], path):
        without, with_it = (
            fit_effort(side.balance(one.joint, one.late), with_body_of(side.models[one.joint], beside)).error
            for side in (before, after)
        )
        removed = max(removed, without**2 - with_it**2)
    return min(removed / whole**2, 1.0) if whole > 0.0 else 0.0


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
    slopes = cause.slopes
    normal, slope = np.zeros((len(slopes), len(slopes))), np.zeros(len(slopes))
    for joint, one in found.items():
        left, of_cause = rows_of(one.result.search.balance, one.result.nominal.fit, columns[joint])
        own = of_cause @ slopes.T
        normal += own.T @ own
        slope += own.T @ left
    change = np.maximum(-np.linalg.solve(normal + np.diag(cause.spreads**-2), slope), cause.least)
    return -0.5 * float(slope @ change)


def rows_of(
    balance: Balance, fit: EffortFit, columns: Sequence[Array], noise: Array | None = None
) -> WeightedRows:
    """What a fitted path leaves of the effort, and the columns (n, p) of a cause, in units of the noise."""
    made = balance.rows(columns, balance.later(fit.model, fit.alignment))
    return in_units_of_noise(fit.residual, made, fit.jacobian, balance.record, noise)


@dataclass(frozen=True, eq=False)
class Options:
    """Hypotheses of a joint, what each leaves beside any cause, as triangles (h, r, p + 1) of columns and residual, and what its effects cost (h,).

    `count` is the number of independent rows. `usual` is the sum of squares that models of real machines leave of such an effort.
    """

    fits: Sequence[Fitted]
    triangles: Array
    prices: Array
    count: float
    usual: float

    def squares(self, change: Array) -> Array:
        """Sums of squares (h,) under a `change` (p,) of the coordinates."""
        left = self.triangles @ np.append(change, 1.0)
        return np.maximum(np.sum(left**2, axis=1), TINY)

    def costs(self, change: Array, usual: float = 0.0) -> Array:
        """Negative log likelihoods (h,) with the best size of the noise, and with the prices, under a `change` (p,) of the coordinates, where a sum of
        squares that is `usual` says nothing."""
        return 0.5 * self.count * np.log(self.squares(change) + usual) + self.prices

    def of(self, places: slice) -> "Options":
        """The options beside these coordinates alone."""
        own = [self.triangles[:, :, places], self.triangles[:, :, -1:]]
        return replace(self, triangles=np.concatenate(own, axis=2))


@dataclass(frozen=True, eq=False)
class Beside:
    """The hypothesis of each joint, by joint, that is best beside the best cause, with the numbers (k,) and the `gain` of log likelihood, to first order."""

    fits: Mapping[str, Fitted]
    numbers: Array
    gain: float


def options_of(one: JointResult, columns: Sequence[Array]) -> Options:
    """The hypotheses that a cause may have beside it at a joint, in units of the noise beside the chosen one.

    They are all that its search has fitted, without a value of the body and a longer delay, which may stand for the cause, and a dry friction: a law
    that is not the best one without the cause may be the best one beside it, as the friction of a joint that carries an unknown weight.
    """
    noise, price = one.result.chosen.fit.residual, decisive(one.result.contest.candidates)
    balance = one.result.search.balance
    fits = [*laws_of(one), *with_dry_friction(one)]
    triangles = []
    for part in fits:
        left, own = rows_of(balance, part.fit, columns, noise)
        triangles.append(np.linalg.qr(np.column_stack([own, left]), mode="r"))
    count = len(noise) / autocorrelation_time(noise, balance.record)
    usual = count * (UNNAMED_EFFORT * variation_of(balance) / scale_of(noise)) ** 2
    prices = price * np.array([len(part.elements) for part in fits])
    return Options(fits, np.array(triangles), prices, count, usual)


def best_beside(options: Mapping[str, Options], cause: Cause) -> Beside:
    """The hypothesis of each joint that is best beside the best cause, to first order.

    Cause and hypotheses are chosen in turn, and the joints weighted by what is then left of their efforts, from the cause that each hypothesis of one
    effect alone gives: a law of a joint that stands for the cause would hide it. While the numbers are sought, what models of real machines
    leave of an effort calls for no law.
    """
    slopes, spreads = cause.slopes, cause.spreads
    joints = list(options)
    normal = {joint: _information(options[joint], slopes) for joint in joints}

    def improved(numbers: Array, places: Mapping[str, int]) -> Array:
        total = np.diag(np.append(spreads**-2.0, 0.0))
        for joint, place in places.items():
            left = options[joint].squares(numbers @ slopes)[place]
            total = total + options[joint].count / left * normal[joint][place]
        return np.maximum(-np.linalg.solve(total[:-1, :-1], total[:-1, -1]), cause.least)

    def chosen_with(numbers: Array, told: bool) -> tuple[float, dict[str, int]]:
        costs = {
            joint: one.costs(numbers @ slopes, 0.0 if told else one.usual) for joint, one in options.items()
        }
        prior = 0.5 * float(np.sum((numbers / spreads) ** 2))
        places = {joint: int(one.argmin()) for joint, one in costs.items()}
        return prior + sum(float(one.min()) for one in costs.values()), places

    nothing = np.zeros(len(spreads))
    best = *chosen_with(nothing, False), nothing
    single = [
        (joint, k) for joint in joints for k, fit in enumerate(options[joint].fits) if len(fit.elements) <= 1
    ]
    seen: set[tuple[int, ...]] = set()
    for joint, place in single:
        numbers, cost = improved(nothing, {joint: place}), math.inf
        for _ in range(TURNS):
            before, (cost, places) = cost, chosen_with(numbers, False)
            if cost < best[0]:
                best = cost, places, numbers
            if (key := tuple(places.values())) in seen and before - cost < SAME:
                break
            seen.add(key)
            numbers = improved(numbers, places)
    numbers = best[2]
    cost, places = chosen_with(numbers, True)
    gain = chosen_with(nothing, True)[0] - cost
    return Beside({joint: options[joint].fits[place] for joint, place in places.items()}, numbers, gain)


def _information(options: Options, slopes: Array) -> Array:
    """For each hypothesis the normal matrix (h, k + 1, k + 1) of the numbers and the residual."""
    made = np.concatenate([options.triangles[:, :, :-1] @ slopes.T, options.triangles[:, :, -1:]], axis=2)
    return np.swapaxes(made, 1, 2) @ made


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
        numbers, covariance = refined(weighted, cause, before)
        if np.all(np.abs(numbers - before) <= SETTLED * np.sqrt(np.diag(covariance))):
            break
    return numbers, covariance, fitted


def refined(rows: Sequence[WeightedRows], cause: Numbers, start: Array) -> tuple[Array, Array]:
    """Improved numbers (k,) from a `start` (k,), and their covariance (k, k); `rows` are residuals and columns in units of the noise, about the start."""
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


def matters(now: JointBalances, before: JointBalances, found: Mapping[str, JointResult]) -> bool:
    """Whether the cause changes the effort of some joint by a practical size, beyond what the joint's path explains by itself."""
    for joint, one in found.items():
        balance = now.balance(joint, one.late)
        left = fit_effort(balance, before.models[joint]).error
        removed = one.result.nominal.fit.error**2 - left**2
        if math.sqrt(max(removed, 0.0)) > PRACTICAL_EFFORT * variation_of(balance):
            return True
    return False
