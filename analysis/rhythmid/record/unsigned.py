"""An unsigned effort: a current or a load of which only the size was recorded, as many motor drivers give it.

It never changes its sign though the motion reverses. So does one that holds a weight; but that one goes with the direction of the
motion, as friction does, and with its place and acceleration, and so does what pushes only, where it does; an unsigned one goes with
their sizes.
"""

import numpy as np
from numpy.typing import NDArray

from rhythmid.record.record import Record

Array = NDArray[np.float64]
EACH_WAY = 0.1  # of the time, that the motion goes each way at least
SLOW = 0.1  # of its largest speed (the 95 % quantile), below which it goes no way
LEAST_SAMPLES = 100  # for the laws, of five terms each, to be told apart
LEAST_SHARE_TOLD = 0.2  # of the effort's variance, that the sizes tell at least
BETTER_LAW_SHARE = 0.8  # of what the signed law leaves of it, up to which the law of sizes is the better one
ROUNDS = 10  # of signs and laws in turn [Fienup, Applied Optics 21 (1982) 2758, of the phases of a signal]; few change after
AVERAGED = 2  # samples on either side, of which a motion that is read coarsely has its speed
WHY = (
    "it is no effort as it was recorded: it never changes its sign though the motion reverses, and goes with the sizes of speed and "
    "acceleration, not with their directions; record it with its sign"
)


def unsigned_notes(record: Record) -> list[str]:
    """A line on each effort of a record that has lost its sign."""
    if record.output_kind != "position":
        return []
    output, found = record.output, list[str]()
    for role, channel in (("input", record.input), ("effort", record.effort)):
        if channel is None or (role == "input" and record.input_kind != "force"):
            continue
        at_once = np.interp(output.time, channel.time, channel.value)
        if is_unsigned(output.time, output.value, at_once):
            found.append(f"{role}: {WHY}")
    return found


def is_unsigned(time: Array, position: Array, effort: Array) -> bool:
    """Whether an effort (n,) is that of a motion (n,) without its sign."""
    if len(time) < LEAST_SAMPLES or not np.isfinite(position).all() or not np.isfinite(effort).all():
        return False
    if effort.min() < 0.0 < effort.max() or np.ptp(effort) == 0.0:
        return False
    speed = np.gradient(_mean(position), time)
    least = SLOW * float(np.quantile(np.abs(speed), 0.95))
    if least == 0.0 or min(np.mean(speed > least), np.mean(speed < -least)) < EACH_WAY:
        return False
    acceleration = np.gradient(_mean(speed), time)
    way = np.tanh(speed / least)
    terms = np.column_stack([np.ones(len(time)), position - position.mean(), speed, way, acceleration])
    signed = _left(effort, _law(terms, effort))
    signed = min(signed, _left(np.abs(effort), _one_sided(terms, np.abs(effort))))
    sizes = _left(effort, _law(np.column_stack([terms[:, :2], np.abs(terms[:, 2:])]), effort))
    for column in (way, acceleration, position - position.mean()):
        sizes = min(sizes, _left(np.abs(effort), _size_of_law(terms, np.abs(effort), np.sign(column))))
    return sizes <= min(1.0 - LEAST_SHARE_TOLD, BETTER_LAW_SHARE * signed)


def _mean(value: Array) -> Array:
    """The mean of each sample and its neighbours."""
    count = 2 * AVERAGED + 1
    return np.convolve(
        np.pad(value, AVERAGED, mode="edge"), np.full(count, 1.0 / count), mode="valid"
    ).astype(np.float64)


def _law(terms: Array, effort: Array) -> Array:
    """What a law of these terms (n, m) makes of the effort (n,)."""
    return terms @ np.linalg.lstsq(terms, effort, rcond=None)[0]


def _size_of_law(terms: Array, size: Array, sign: Array) -> Array:
    """The size (n,) of a law of these terms (n, m): the signs are those that the law has, from a first guess on."""
    law = size
    for _ in range(ROUNDS):
        law = _law(terms, sign * size)
        sign = np.sign(law)
    return np.abs(law)


def _one_sided(terms: Array, size: Array) -> Array:
    """What a law of these terms (n, m) makes of a force (n,) that can push only, as a contact or a rope does."""
    law = size
    for _ in range(ROUNDS):
        pushing = law > 0.0
        if np.count_nonzero(pushing) < LEAST_SAMPLES:
            break
        law = terms @ np.linalg.lstsq(terms[pushing], size[pushing], rcond=None)[0]
    return np.maximum(law, 0.0)


def _left(effort: Array, law: Array) -> float:
    """Share of an effort's variance that a law leaves."""
    return float(np.mean((effort - law) ** 2) / np.var(effort))
