"""Delay of controllers' references relative to their timestamps, where efforts are computed from references and gains.

The delay of each joint is a parameter of its effort balance and has an interval. References of several joints
usually arrive in one message, so all have one delay. The delay with which most joints agree is shared. A test says
whether all joints agree.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.stats import chi2
from threadpoolctl import threadpool_limits

from rhythmid.errors import InputError
from rhythmid.identify.inverse_dynamics.balance import Balance
from rhythmid.identify.inverse_dynamics.estimate import FARTHEST, ROUGH, Alignment, EffortFit, fit_effort
from rhythmid.identify.joints.joint_motion import JointBalances
from rhythmid.identify.least_squares import orthonormal
from rhythmid.identify.student import weights_of
from rhythmid.model import Model
from rhythmid.statistics import NORMAL_95

Array = NDArray[np.float64]
LONGEST_REFERENCE_DELAY = 0.1  # [s] largest delay of a reference
FIRST = 3  # Gauss-Newton steps of the fit before the scan of delays: the parameters are nearly linear
# share of a sample: standard deviation by which a missing effect may shift the delay of a joint, where joints are
# said to agree or to differ
AGREES = 0.5
EQUAL = 0.01  # probability of such a scatter of equal delays below which not all joints share one delay


@dataclass(frozen=True)
class Delay:
    """A delay [s] with its standard deviation."""

    value: float
    std: float

    @property
    def interval(self) -> tuple[float, float]:
        """The 95 % interval."""
        return self.value - NORMAL_95 * self.std, self.value + NORMAL_95 * self.std


@dataclass(frozen=True)
class ReferenceDelay:
    """Delay [s] of references beyond the model's delays: of each joint, and the shared one of those that `agree`.

    `chance` is the probability of delays as unequal as these if all joints have the same delay, which a missing effect may
    shift at each of them; None for one joint.
    """

    shared: Delay
    joints: dict[str, Delay]
    agree: tuple[str, ...]
    chance: float | None

    @cached_property
    def equal(self) -> bool:
        """Whether the records are consistent with one delay for all joints."""
        return self.chance is None or self.chance >= EQUAL

    @property
    def told(self) -> str:
        """The shared delay and the test of equality, in one sentence."""
        value, std = 1e3 * self.shared.value, 1e3 * self.shared.std
        said = f"the references act {value:.2f} ± {std:.2g} ms later than the model says"
        if self.chance is None:
            return said
        if self.equal:
            return f"{said}, at all joints alike (test of equality: p = {self.chance:.2g})"
        others = [
            f"{joint} {1e3 * one.value:.2f} ± {1e3 * one.std:.2g} ms"
            for joint, one in self.joints.items()
            if joint not in self.agree
        ]
        of = ", ".join(self.agree)
        beside = f"; otherwise at {', '.join(others)}" if others else ""
        return f"{said} at {of}{beside} (test of equality: p = {self.chance:.2g})"


@threadpool_limits.wrap(limits=1)
def reference_delay(balances: JointBalances, joints: Sequence[str]) -> ReferenceDelay:
    """The delays at which the paths of these joints, with their free parameters fitted, predict the efforts best.

    Raises InputError where no joint can be fitted."""
    found: dict[str, Delay] = {}
    why = ""
    for joint in joints:
        try:
            fit = delay_fit(balances.balance(joint), balances, joint)
        except InputError as error:
            why = str(error)
            continue
        found[joint] = Delay(fit.alignment, float(np.hypot(fit.std[0], ROUGH * balances.period)))
    if not found:
        raise InputError(f"no joint shows the delay of its reference: {why}")
    return shared(found, balances.period)


def delay_fit(balance: Balance, balances: JointBalances, joint: str) -> EffortFit:
    """The fit of a joint's path with the delay of its reference free, started without delay and at the best point of a scan.

    A longer delay makes the computed effort itself smaller, and with it everything that the path lacks. So a delay has to be worth its prior
    of a sample, and what is left, which lasts for many rows, counts as often as it is independent.
    """
    model = balances.models[joint]
    flat = Alignment(LONGEST_REFERENCE_DELAY, -FARTHEST * balance.period, LONGEST_REFERENCE_DELAY)
    start = _scanned(balance, model, flat)
    free = fit_effort(balance, model, aligned=flat, alignment=start)
    usual = Alignment.of(balance)
    known = replace(flat, std=usual.std / math.sqrt(free.correlation))
    fits = [fit_effort(balance, model, aligned=known, alignment=at) for at in (free.alignment, 0.0)]
    best = min(fits, key=lambda fit: fit.cost)
    return replace(best, std=np.append(best.std[0] * math.sqrt(free.correlation), best.std[1:]))


def fit_with_delay(balance: Balance, model: Model, joint: str, common: ReferenceDelay | None) -> EffortFit:
    """The fit of a joint's path, in which its reference has the delay of `common` where it was not recorded as an effort.

    If all joints have one delay, this joint has it to the jitter of timestamps; its standard deviation enters those of the
    values. If only some agree, these have it to a sample, as for timestamps. For a joint with another delay, the prior is
    about its own delay and at least one sample wide.
    """
    if common is None or joint not in common.joints:
        return fit_effort(balance, model)
    own, most = common.joints[joint], FARTHEST * balance.period
    if common.equal:
        fit = fit_effort(balance, model, aligned=Alignment(ROUGH * balance.period, -most, most))
        uncertain = Alignment(common.shared.std, -most, most)
        wide = fit_effort(balance, fit.model, aligned=uncertain, alignment=fit.alignment, steps=0)
        return replace(fit, std=wide.std)
    if joint in common.agree:
        return fit_effort(balance, model, aligned=Alignment.of(balance))
    apart = own.value - common.shared.value
    std = max(own.std, balance.period)
    return fit_effort(balance, model, aligned=Alignment(std, apart - most, apart + most, apart))


def _scanned(balance: Balance, model: Model, wide: Alignment) -> float:
    """The delay [s] within these limits with the least error of the path fitted without one. Raises InputError where nothing can be fitted."""
    first = fit_effort(balance, model, steps=FIRST)
    weight = weights_of(first.residual, first.scale) / first.scale**2
    root = np.sqrt(weight)
    basis = orthonormal(first.jacobian[:, 1:] * root[:, None]) if first.names else np.zeros((len(root), 0))
    required = balance.rows(balance.required(first.model), balance.later(first.model))
    tried = np.arange(wide.low, wide.high, balance.period)
    costs = []
    for late in tried:
        error = root * (balance.with_moved(required, first.model, float(late)) - balance.measured)
        error = error - basis @ (basis.T @ error)
        costs.append(float(error @ error))
    if not np.isfinite(costs).all():
        raise InputError("the joints cannot be fitted: their motion holds too little")
    return float(tried[int(np.argmin(costs))])


def shared(joints: dict[str, Delay], period: float) -> ReferenceDelay:
    """The delay with which most joints agree. In a tie the shorter one is taken, because a further element makes a
    reference later."""
    names = list(joints)
    values = np.array([one.value for one in joints.values()])
    variances = np.array([one.std**2 for one in joints.values()])
    apart = np.abs(values[:, None] - values)
    near = apart <= 2.0 * np.sqrt(variances[:, None] + variances + (AGREES * period) ** 2)
    counts = near.sum(axis=1)
    first = min(np.flatnonzero(counts == counts.max()), key=lambda place: values[place])
    some = near[first]
    weights = 1.0 / variances
    middle = float(weights[some] @ values[some] / weights[some].sum())
    spread = float((weights[some] * (values[some] - middle) ** 2).sum()) / max(int(some.sum()) - 1, 1)
    std = np.sqrt(
        max(spread, 1.0) / weights[some].sum()
    )  # widened to their scatter (R. T. Birge, Phys. Rev. 40 (1932) 207)
    chance = None
    if len(names) > 1:
        alike = 1.0 / (variances + (AGREES * period) ** 2)
        mean = float(alike @ values / alike.sum())
        chance = float(chi2.sf(float(alike @ (values - mean) ** 2), len(names) - 1))
    agree = tuple(name for name, one in zip(names, some, strict=True) if one)
    return ReferenceDelay(Delay(middle, float(std)), dict(joints), agree, chance)
