"""Detects an unsigned effort: a current or load of which only the magnitude was recorded, as many motor drivers do.

It never changes its sign although the motion reverses. An effort that holds a weight does not, either, but it is
correlated with the direction of the motion (friction), with position and acceleration, and where a controller makes it, with
the error between reference and position. So is, where it acts, an effort that can only push. An unsigned effort is correlated with the
magnitudes of these.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from rhythmid.record.joint_record import JointRecord
from rhythmid.record.record import Record

Array = NDArray[np.float64]
EACH_WAY = 0.1  # least share of the time in either direction of motion
SLOW = 0.1  # share of the largest speed (95 % quantile) below which a motion has no direction
LEAST_SAMPLES = 100  # to distinguish the laws, of five terms each
LEAST_SHARE_TOLD = 0.2  # least share of the effort's variance that the law of magnitudes explains
# ratio of residuals to those of the signed law below which the law of magnitudes is better
BETTER_LAW_SHARE = 0.8
# iterations of signs and laws in turn [Fienup, Applied Optics 21 (1982) 2758, for the phases of a signal]; few
# signs change after
ROUNDS = 10
AVERAGED = 2  # samples on either side averaged for the speed of a coarsely read motion
WHY = (
    "it is no effort as it was recorded: it never changes its sign though the motion reverses, and goes with the sizes of speed, "
    "acceleration or control error, not with their directions; record it with its sign"
)


def unsigned_notes(record: Record) -> list[str]:
    """A line on each effort of a record that was recorded without its sign."""
    return [f"{role}: {WHY}" for role in unsigned_roles(record)]


def unsigned_roles(record: Record) -> list[str]:
    """The roles of the efforts of a record that were recorded without their sign."""
    if record.output_kind == "acceleration":
        return []
    output, found = record.output, list[str]()
    asked = _asked(record)
    for role, channel in (("input", record.input), ("effort", record.effort)):
        if channel is None or (role == "input" and record.input_kind != "force"):
            continue
        at_once = np.interp(output.time, channel.time, channel.value)
        if is_unsigned(output.time, output.value, at_once, asked, is_speed=record.output_kind == "velocity"):
            found.append(role)
    return found


def unsigned_joints(records: Sequence[JointRecord]) -> dict[str, str]:
    """The joints whose efforts were recorded without their sign in all records, with the reason; none where no record is given."""
    found: dict[str, list[Record]] = {}
    for one in records:
        for joint, own in one.joints.items():
            found.setdefault(joint, []).append(own)
    return {
        joint: f"effort: {WHY}"
        for joint, runs in found.items()
        if all(f"effort: {WHY}" in unsigned_notes(one) for one in runs)
    }


def _asked(record: Record) -> Array | None:
    """Reference (n,) of the position at the samples of the output; None where there is none."""
    if record.input is None or record.input_kind != "reference":
        return None
    return np.interp(record.output.time, record.input.time, record.input.value)


def is_unsigned(
    time: Array, motion: Array, effort: Array, reference: Array | None = None, *, is_speed: bool = False
) -> bool:
    """Whether an effort (n,) is that of a motion (n,) without its sign.

    `reference` (n,) is what a controller was asked for. The motion is a position, or `is_speed`; of a speed no force of the position
    is known.
    """
    if len(time) < LEAST_SAMPLES or not np.isfinite(motion).all() or not np.isfinite(effort).all():
        return False
    if effort.min() < 0.0 < effort.max() or np.ptp(effort) == 0.0:
        return False
    speed = _mean(motion) if is_speed else np.gradient(_mean(motion), time)
    position = np.zeros(len(time)) if is_speed else motion
    least = SLOW * float(np.quantile(np.abs(speed), 0.95))
    if least == 0.0 or min(np.mean(speed > least), np.mean(speed < -least)) < EACH_WAY:
        return False
    acceleration = np.gradient(_mean(speed), time)
    way = np.tanh(speed / least)
    terms = np.column_stack([np.ones(len(time)), position - position.mean(), speed, way, acceleration])
    signs = [way, acceleration, position - position.mean()]
    if reference is not None and np.isfinite(reference).all():
        terms = np.column_stack([terms, reference - motion])
        signs.append(reference - motion)
    signed = _left(effort, _law(terms, effort))
    signed = min(signed, _left(np.abs(effort), _one_sided(terms, np.abs(effort))))
    sizes = _left(effort, _law(np.column_stack([terms[:, :2], np.abs(terms[:, 2:])]), effort))
    for column in signs:
        sizes = min(sizes, _left(np.abs(effort), _size_of_law(terms, np.abs(effort), np.sign(column))))
    return sizes <= min(1.0 - LEAST_SHARE_TOLD, BETTER_LAW_SHARE * signed)


def _mean(value: Array) -> Array:
    """The mean of each sample and its neighbours."""
    count = 2 * AVERAGED + 1
    return np.convolve(
        np.pad(value, AVERAGED, mode="edge"), np.full(count, 1.0 / count), mode="valid"
    ).astype(np.float64)


def _law(terms: Array, effort: Array) -> Array:
    """Least-squares fit (n,) of a law with these terms (n, m) to the effort (n,)."""
    return terms @ np.linalg.lstsq(terms, effort, rcond=None)[0]


def _size_of_law(terms: Array, size: Array, sign: Array) -> Array:
    """Magnitude (n,) of a law with these terms (n, m); the signs are iterated from a first guess to those of the law."""
    law = size
    for _ in range(ROUNDS):
        law = _law(terms, sign * size)
        sign = np.sign(law)
    return np.abs(law)


def _one_sided(terms: Array, size: Array) -> Array:
    """Fit (n,) of a law with these terms (n, m) to a force (n,) that can only push, as of a contact or a rope."""
    law = size
    for _ in range(ROUNDS):
        pushing = law > 0.0
        if np.count_nonzero(pushing) < LEAST_SAMPLES:
            break
        law = terms @ np.linalg.lstsq(terms[pushing], size[pushing], rcond=None)[0]
    return np.maximum(law, 0.0)


def _left(effort: Array, law: Array) -> float:
    """Share of an effort's variance that a law leaves unexplained."""
    return float(np.mean((effort - law) ** 2) / np.var(effort))
