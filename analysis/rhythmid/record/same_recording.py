"""Recordings that are given twice: one that is fitted cannot be held out too."""

from collections.abc import Sequence

import numpy as np

from rhythmid.errors import InputError
from rhythmid.record.joint_record import JointRecord
from rhythmid.record.record import Record


def check_held_out(fitted: Sequence[Record | JointRecord], holdout: Sequence[Record | JointRecord]) -> None:
    """Raise InputError where a held-out record is one of the fitted ones, whatever either is called."""
    for one in holdout:
        if any(_same(one, other) for other in fitted):
            raise InputError(
                f"{one.name}: is fitted and held out; a record judges only where no fit has seen it, so leave it out of one of the two"
            )


def _same(one: Record | JointRecord, other: Record | JointRecord) -> bool:
    first, second = _outputs(one), _outputs(other)
    return len(first) == len(second) and all(
        np.array_equal(a.output.time, b.output.time)
        and np.array_equal(a.output.value, b.output.value, equal_nan=True)
        for a, b in zip(first, second, strict=True)
    )


def _outputs(one: Record | JointRecord) -> tuple[Record, ...]:
    return tuple(one.joints.values()) if isinstance(one, JointRecord) else (one,)
