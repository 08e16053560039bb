"""Selects the joint to identify among several: the requested one, else the one that moves most."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field

import numpy as np

from rhythmid.errors import InputError
from rhythmid.record.inventory import Recorded
from rhythmid.record.standstill import FLICKER
from rhythmid.start.meaning import Meaning, joint_of_column, same_joint
from rhythmid.start.vocabulary import Quantity
from rhythmid.start.words import words_of

CLOSE_MOTION = 0.7  # ratio to the largest motion of a joint above which the user is asked about another joint


@dataclass(frozen=True)
class Joint:
    """The selected joint (empty where there is only one), the motion of every joint (standard deviation), the names of
    `further` joints without a recorded motion, and whether it was `requested`."""

    name: str = ""
    motion: dict[str, float] = field(default_factory=dict)
    further: frozenset[str] = frozenset()
    requested: bool = False

    @property
    def others(self) -> list[str]:
        """The other joints, in descending order of motion."""
        return sorted(
            (name for name in self.motion if name != self.name), key=lambda name: -self.motion[name]
        )

    def includes(self, one: Recorded, meaning: Meaning) -> bool:
        """Whether a number belongs to this joint, or to no other joint."""
        if not self.name or meaning.joint == self.name:
            return True
        if meaning.joint in self.motion:
            return False
        # tau_cal_3 belongs to joint 3, whatever cal means
        said = {*words_of(one.topic), *words_of(meaning.joint)}
        if self._telling(self.name) <= said:
            return True
        return not any(self._telling(other) <= said for other in (*self.others, *self.further))

    def _telling(self, name: str) -> set[str]:
        """Words of a joint's name that not all joints share; the whole name where these are only numbers, which
        have other uses, too."""
        common = set.intersection(*(set(words_of(one)) for one in self.motion))
        words = set(words_of(name))
        rest = words - common
        return words if all(word.isdigit() for word in rest) else rest


def joint_of(
    known: Sequence[tuple[Recorded, Meaning]],
    still: Sequence[tuple[Recorded, Meaning]],
    wanted: str | None,
    ask: Callable[[str, Sequence[str]], int],
    place: str,
) -> Joint:
    """The joint to identify; the numbers in `still` are constant. Raises InputError where none is called `wanted`,
    or that one is at rest."""
    motion: dict[str, float] = {}
    order: tuple[Quantity, ...] = ("position", "velocity", "acceleration")
    for quantity in order:
        able = _measured(known, quantity)
        if wanted is None:  # a number with a few values only is no motion if there is another one
            able = [(one, meaning) for one, meaning in able if shows_motion(one)] or able
        if able and not motion:
            motion = {meaning.joint: 0.0 for _, meaning in _measured(still, quantity)}
            for one, meaning in able:
                motion[meaning.joint] = max(motion.get(meaning.joint, 0.0), float(np.nanstd(one.value)))
    if not motion:
        motion = _motion_of_untold(known, still)
    if wanted is not None and wanted not in motion:
        called = [name for name in motion if same_joint(name, wanted)] or _with_words(wanted, motion)
        wanted = called[0] if len(called) == 1 else wanted
    if wanted is not None and motion.get(wanted) == 0.0:
        raise InputError(f"{place}: joint {wanted!r} stands still")
    if wanted is not None:
        if wanted not in motion:
            raise InputError(
                f"{place}: no joint is called {wanted!r}; it has {', '.join(motion) or 'no named joints'}"
            )
        return Joint(wanted, motion, _further(wanted, known, asked=True), requested=True)
    ranked = sorted(motion, key=lambda name: -motion[name])
    if len(ranked) < 2:
        name = ranked[0] if ranked else ""
        return Joint(name, motion, _further(name, known))
    close = [name for name in ranked if motion[name] >= CLOSE_MOTION * motion[ranked[0]]]
    number = ask("Which joint is looked at?", close) if len(close) > 1 else 0
    return Joint(close[number], motion, _further(close[number], known))


def _with_words(wanted: str, names: Iterable[str]) -> list[str]:
    """The names that start with the words of another one, as swing_sensor with swing; else those that contain them,
    as arm_pitch contains pitch."""
    words = words_of(wanted)
    holding = [name for name in names if words and f" {' '.join(words)} " in f" {' '.join(words_of(name))} "]
    return [name for name in holding if words_of(name)[: len(words)] == words] or holding


def _further(name: str, known: Sequence[tuple[Recorded, Meaning]], asked: bool = False) -> frozenset[str]:
    """Joints whose columns have the names of those of the joint `name` except for the first words: beside Swing Ms,
    Boom Ms is of the boom.

    Where the joint was requested (`asked`), also those whose columns have matching names among themselves.
    """
    own = words_of(name)
    heads: dict[tuple[str, ...], set[tuple[str, ...]]] = {}
    for words in (words_of(one.said) for one, _ in known if one.column and own):
        for place in range(1, len(words)):
            heads.setdefault(tuple(words[place:]), set()).add(tuple(words[:place]))
    alike = [
        {head for head in found if all(not word.isdigit() and joint_of_column(word) for word in head)}
        for found in heads.values()
        if any(list(head) == own for head in found) or (asked and len(found) > 1)
    ]
    return frozenset("_".join(head) for found in alike for head in found if not set(own) <= set(head))


def _motion_of_untold(
    known: Sequence[tuple[Recorded, Meaning]], still: Sequence[tuple[Recorded, Meaning]]
) -> dict[str, float]:
    """Motion of joints without a named quantity, such as FR_2_actual beside FR_2_target: the quantity that a
    controller commands and measures at every joint is its motion."""
    asked = {meaning.joint for _, meaning in (*known, *still) if meaning.commanded is True}
    motion: dict[str, float] = {}
    for one, meaning in (*known, *still):
        told = meaning.quantity is not None or meaning.commanded is not False
        if told or not meaning.joint or meaning.joint[0] == "#" or meaning.joint not in asked:
            continue
        motion[meaning.joint] = max(motion.get(meaning.joint, 0.0), float(np.nanstd(one.value)))
    return motion if len(motion) > 1 else {}


def shows_motion(one: Recorded) -> bool:
    """Whether it has more distinct values than a sensor of a machine at rest."""
    return len(np.unique(one.value[np.isfinite(one.value)])) > FLICKER


def _measured(
    known: Sequence[tuple[Recorded, Meaning]], quantity: Quantity
) -> list[tuple[Recorded, Meaning]]:
    """Measured motions of named joints."""
    return [
        (one, meaning) for one, meaning in known
        if meaning.quantity == quantity and meaning.commanded is not True and meaning.joint and meaning.joint[0] != "#"
    ]  # fmt: skip
