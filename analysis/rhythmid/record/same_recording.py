"""Detects recordings that are given twice: a fitted one cannot be held out, and a duplicate counts once."""

import hashlib
from collections.abc import Sequence

import numpy as np

from rhythmid.errors import InputError
from rhythmid.record.joint_record import JointRecord
from rhythmid.record.record import Record


def check_held_out(fitted: Sequence[Record | JointRecord], holdout: Sequence[Record | JointRecord]) -> None:
    """Raise InputError where a held-out record is one of the fitted ones, whatever their names."""
    for one in holdout:
        if any(_same(one, other) for other in fitted):
            raise InputError(
                f"{one.name}: is fitted and held out; a record judges only where no fit has seen it, so leave it out of one of the two"
            )


def content_digest(records: Sequence[Record | JointRecord]) -> str:
    """Digest of the measured data, in hexadecimal digits: recordings with the same digest are copies, whatever
    their names."""
    digest = hashlib.sha256()
    for record in records:
        for one in _outputs(record):
            digest.update(
                np.rint(1e9 * one.output.time).astype(np.int64).tobytes()
            )  # resolution of stamps: nanoseconds
            digest.update(one.output.value.tobytes())
    return digest.hexdigest()


def _same(one: Record | JointRecord, other: Record | JointRecord) -> bool:
    first, second = _outputs(one), _outputs(other)
    return len(first) == len(second) and all(
        np.array_equal(a.output.time, b.output.time)
        and np.array_equal(a.output.value, b.output.value, equal_nan=True)
        for a, b in zip(first, second, strict=True)
    )


def _outputs(one: Record | JointRecord) -> tuple[Record, ...]:
    return tuple(one.joints.values()) if isinstance(one, JointRecord) else (one,)
