"""Isolation: the slot of the signal path in which the physics has changed, the size of the change, and the present delays."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from rhythmid.twin.changes import DELAYS, Change
from rhythmid.twin.detector import Healthy
from rhythmid.twin.score import Score, inverse

Array = NDArray[np.float64]
ODDS = 2.0 * np.log(20.0)  # in χ²: a slot is named alone when it is twenty times as likely as every other
# Share of the square of a change's effect below which two changes count as equivalent. Effects are computed as proportional to a
# change's size; but a delay of 5 ms shifts a signal of 5 Hz by an amount that differs from this by 8 %, 0.6 % of the square.
ALIKE = 0.01
SHOWN = 0.5  # share of the score statistic that the best change must explain; otherwise the change is of no known kind


@dataclass(frozen=True)
class Sized:
    """A change with its size, standard deviation and unit, and the χ² that it explains alone."""

    name: str
    slot: str
    size: float
    std: float
    unit: str
    explained: float


@dataclass(frozen=True)
class Isolation:
    """The location of a mismatch.

    `slot` explains most of it; it is "unknown" where none explains half. `rivals` are slots that cannot be separated from it.
    `share` is the part of the mismatch that each slot's best change explains. `changes` are these best changes, the most likely
    first. `excess` is the overdispersion of what they leave.
    """

    slot: str
    rivals: tuple[str, ...]
    share: dict[str, float]
    changes: tuple[Sized, ...]
    excess: float


def isolate(score: Score, healthy: Healthy, changes: Sequence[Change], excess: float) -> Isolation:
    """Find the slot in which a single change explains the score best.

    `excess` is the overdispersion of the score in healthy operation. It is increased to that of the remainder of the best change: a
    change so large that its effects are no longer proportional to its size leaves more than noise.

    A slot is a rival where its best change is within the odds, or has the same effect on the innovations as the best of all. In the
    latter case only the model's error decides which of the two is first.
    """
    centred = healthy.centred(score)
    information = np.diag(score.information)
    inverted, rank = inverse(score.information)
    whole = max(float(centred @ inverted @ centred), 1e-300)
    best: dict[str, Sized] = {}
    for index, change in enumerate(changes):
        if not information[index] > 0.0:
            continue
        size = float(centred[index] / information[index])
        explained = size**2 * float(information[index])
        if change.slot not in best or explained > best[change.slot].explained:
            std = float(1.0 / np.sqrt(information[index]))
            best[change.slot] = Sized(change.name, change.slot, size, std, change.unit, explained)
    ranked = sorted(best.values(), key=lambda one: -one.explained)
    names = [change.name for change in changes]
    places = [names.index(one.name) for one in ranked]
    if ranked:
        excess = max(excess, (whole - ranked[0].explained) / max(rank - 1, 1))
    ranked = [replace(one, std=one.std * excess**0.5) for one in ranked]
    share = {one.slot: min(1.0, one.explained / whole) for one in ranked}
    if not ranked or share[ranked[0].slot] < SHOWN:
        return Isolation("unknown", tuple(share), share, tuple(ranked), excess)
    rivals = tuple(
        one.slot
        for one, place in zip(ranked[1:], places[1:])
        if ranked[0].explained - one.explained < ODDS * excess
        or _apart(score.information, places[0], place) < ALIKE
    )
    return Isolation(ranked[0].slot, rivals, share, tuple(ranked), excess)


def _apart(information: Array, one: int, other: int) -> float:
    """Share of a change's effect that another change cannot explain: 0 for equivalent changes, 1 for orthogonal ones."""
    alike = float(information[one, other]) ** 2 / float(information[one, one] * information[other, other])
    return max(0.0, 1.0 - alike)


@dataclass(frozen=True)
class DelayNow:
    """A delay [s] in the last window, with its standard deviation; None where it is not identifiable."""

    value: float
    std: float | None


def delays_now(
    score: Score,
    healthy: Healthy,
    changes: Sequence[Change],
    values: Sequence[float],
    beside: str | None,
    excess: float,
) -> dict[str, DelayNow]:
    """Present delays and their sum, from the score of a window.

    `values` [s] are the model's delays in the order of `DELAYS`. They are estimated together with the change `beside`, which may be
    the true cause.
    """
    names = [change.name for change in changes]
    present = [name for name in DELAYS if name in names]
    chosen = [names.index(name) for name in present]
    if beside is not None and beside not in present:
        chosen.append(names.index(beside))
    found: dict[str, DelayNow] = {}
    information = score.information[np.ix_(chosen, chosen)]
    if not present or not np.all(np.diag(information) > 0.0):
        return {
            name.removesuffix("_delay.delay"): DelayNow(value, None) for name, value in zip(DELAYS, values)
        }
    inverted, rank = inverse(information)
    shift = inverted @ healthy.centred(score)[chosen]
    for place, name in enumerate(present):
        value = values[DELAYS.index(name)]
        std = float(np.sqrt(excess * inverted[place, place])) if rank == len(chosen) else None
        found[name.removesuffix("_delay.delay")] = DelayNow(value + float(shift[place]), std)
    if len(present) == len(DELAYS):
        ones = np.zeros(len(chosen))
        ones[: len(present)] = 1.0
        total = sum(values) + float(ones @ shift)
        found["sum"] = DelayNow(total, float(np.sqrt(excess * ones @ inverted @ ones)))
    return found
