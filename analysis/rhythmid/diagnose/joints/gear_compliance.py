"""The compliance of a joint's gear, seen from the motor's side, and its lag: two numbers of the machine that change the efforts of all joints.

An encoder on the motor's side does not see the angle by which the gear yields. The link is elsewhere, and all joints feel that. The joint
itself is judged with its measured torque, whose noise would look like a compliance there; so the other joints estimate it, and the joint
itself may only speak against it.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rhythmid.diagnose.answer.result import Estimate
from rhythmid.diagnose.constants import CONTRADICTS
from rhythmid.diagnose.joints.joint_case import JointResult
from rhythmid.diagnose.joints.linear_cause import side_by_side
from rhythmid.diagnose.joints.machine_cause import Columns, most_promising, worth_it
from rhythmid.diagnose.rejections import decisive
from rhythmid.identify.joints.elastic_gear import ElasticGear
from rhythmid.identify.joints.joint_motion import JointBalances
from rhythmid.model import Model
from rhythmid.report.quantity import with_std

Array = NDArray[np.float64]
STEP = 1e-4  # step of the finite difference, as a share of the prior standard deviation
FASTER = 1e-2  # step of a gear's lag, as a share of the longest one


@dataclass(frozen=True, eq=False)
class GearCompliance:
    """The gear of a joint that yields, as it fits the efforts of the other joints; units of a `rotational` joint or of one that slides.

    Its damping is not told: the lag of the gear also holds what the measured effort is misaligned."""

    joint: str
    gear: ElasticGear
    std: float
    rotational: bool
    weight: float
    probability: float

    @property
    def values(self) -> dict[str, Estimate]:
        """The stiffness of the gear, and its compliance."""
        units = ("N*m/rad", "rad/(N*m)") if self.rotational else ("N/m", "m/N")
        stiffness = 1.0 / self.gear.compliance
        return {
            "stiffness": Estimate(stiffness, self.std * stiffness**2, units[0]),
            "compliance": Estimate(self.gear.compliance, self.std, units[1]),
        }

    @property
    def words(self) -> str:
        """The gear as one clause."""
        stiffness = self.values["stiffness"]
        return (
            f"{self.joint}: the gear yields between encoder and link, with a stiffness of {with_std(stiffness.value, stiffness.std)} "
            f"{stiffness.unit}; the link's angle is that of the encoder less torque over stiffness. No element of a path holds that, so that "
            "a saved model has a rigid gear"
        )


@dataclass(frozen=True, eq=False)
class _Yielding:
    """One joint's gear as a cause of the machine as a whole: its compliance, whose prior standard deviation is the `spread`, and its compliance times
    its lag, with which the efforts change linearly. A gear may lag by a radian at the strongest frequency of the motion."""

    balances: JointBalances
    joint: str
    spread: float
    least: float = 0.0

    @property
    def spreads(self) -> Array:
        return np.array([self.spread, self.spread * self.longest])

    @property
    def longest(self) -> float:
        """The longest lag [s] of a gear."""
        return 1.0 / (2.0 * math.pi * self.balances.dominant)

    @property
    def slopes(self) -> Array:
        return np.eye(2)

    def coordinates(self, numbers: Array) -> Array:
        return numbers

    def gear(self, numbers: Array, paths: Mapping[str, Model]) -> ElasticGear:
        path, compliance = paths[self.joint], float(numbers[0])
        rotor = path.mass.value - self.balances.models[self.joint].mass.value
        return ElasticGear(
            compliance, path, rotor, float(numbers[1]) / compliance if compliance > 0.0 else 0.0
        )

    def imposed(self, numbers: Array, paths: Mapping[str, Model]) -> JointBalances:
        return self._with(numbers, paths, False)

    def columns(self, now: JointBalances, numbers: Array, paths: Mapping[str, Model]) -> Columns:
        """Differences from a gear that yields a little: one that does not has no lag."""
        start = np.maximum(numbers, STEP * self.spreads * [1.0, 0.0])
        before = self._with(start, paths, False)
        made: list[Columns] = []
        # a lag that is short beside the motion
        steps = [STEP * self.spread, FASTER * start[0] * self.longest]
        for step in np.diag(steps):
            moved = self._with(start + step, paths, False)
            made.append(
                {
                    joint: [
                        (after.coupling - one.coupling)[:, None] / step.sum()
                        for after, one in zip(moved.motions[joint], before.motions[joint], strict=True)
                        if after.coupling is not None and one.coupling is not None
                    ]
                    for joint in self.balances.models
                }
            )
        return {joint: side_by_side(one[joint] for one in made) for joint in self.balances.models}

    def in_place(self, numbers: Array, paths: Mapping[str, Model]) -> JointBalances:
        return self._with(numbers, paths, True)

    def _with(self, numbers: Array, paths: Mapping[str, Model], columns: bool) -> JointBalances:
        gears = {**self.balances.gears, self.joint: self.gear(numbers, paths)}
        return self.balances.with_gears(gears, columns)


def likely_gear(balances: JointBalances, found: Mapping[str, JointResult]) -> GearCompliance | None:
    """The gear that the other joints give decisively more than the laws found at each of them; None where none yields.

    The one that promises most is tried; it has to be worth the choice among all joints.
    """
    causes = {
        joint: _Yielding(balances, joint, softest(balances, joint))
        for joint, one in found.items()
        if joint not in balances.gears and len(found) > 1 and not one.result.search.balance.undriven
    }
    joint = most_promising(causes, balances, found)
    if joint is None:
        return None
    cause = causes[joint]
    made = worth_it(cause, balances, found, [other for other in found if other != joint])
    if made is None:
        return None
    compliance, std = float(made.numbers[0]), math.sqrt(float(made.covariance[0, 0]))
    if compliance <= CONTRADICTS * std or made.weight <= decisive(len(causes)):
        return None
    return GearCompliance(
        cause.joint,
        cause.gear(made.numbers, made.paths),
        std,
        balances.machine.body.joints[cause.joint].rotational,
        made.weight,
        made.probability,
    )


def softest(balances: JointBalances, joint: str) -> float:
    """Compliance of a gear on which the joint would resonate at the strongest frequency of the motion: no controller holds a softer one."""
    return 1.0 / (balances.models[joint].mass.value * (2.0 * math.pi * balances.dominant) ** 2)
