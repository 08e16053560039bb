"""A cause of the machine as a whole with whose coordinates the efforts change linearly."""

from abc import ABC, abstractmethod
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from rhythmid.diagnose.joints.machine_cause import Array, Columns
from rhythmid.identify.joints.joint_motion import JointBalances
from rhythmid.model import Model
from rhythmid.record.joint_record import JointRecord


@dataclass(frozen=True, eq=False)
class LinearCause(ABC):
    """A cause with whose coordinates (p,) the efforts of the `balances` change linearly, by these `weights` (n, p)."""

    balances: JointBalances
    records: Sequence[JointRecord]
    weights: Columns

    @abstractmethod
    def coordinates(self, numbers: Array) -> Array:
        """As for `Numbers`."""

    def imposed(self, numbers: Array, paths: Mapping[str, Model]) -> JointBalances:
        """The balances with these numbers; columns of links are left as they are."""
        change = self.coordinates(numbers)
        motions = {
            joint: [
                one if one.coupling is None else replace(one, coupling=one.coupling + weight @ change)
                for one, weight in zip(made, self.weights[joint], strict=True)
            ]
            for joint, made in self.balances.motions.items()
        }
        return replace(self.balances, motions=motions)

    def columns(self, now: JointBalances, numbers: Array, paths: Mapping[str, Model]) -> Columns:
        """The weights, whatever the numbers are."""
        return self.weights


def side_by_side(columns: Iterable[Sequence[Array]]) -> list[Array]:
    """Columns (n, p) of each motion of several causes as one array a motion."""
    return [np.concatenate(parts, axis=1) for parts in zip(*columns, strict=True)]
