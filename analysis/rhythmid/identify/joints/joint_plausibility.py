"""Detects joints recorded in another order, unit or sign, by the effort balance.

As for one axis (`identify/plausibility.py`), a change is accepted only where the record as declared cannot be
explained and the changed record can. With several joints, changes are searched one after another, the most helpful
first: another factor for one joint or for all, an exchange of two joints, a cycle of three. Changes that do not
help in the end are removed. Efforts in unknown units, such as a motor's current, are searched last. There every
effort may have its own factor; the balance determines it for joints on which weight or coupling acts.
"""

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import combinations

import numpy as np

from rhythmid.body.machine import Machine
from rhythmid.errors import InputError
from rhythmid.identify.channel_change import DEGREE, NAMED, UNITS
from rhythmid.identify.joint import POOR_MOTION
from rhythmid.identify.joints.joint_reading import Balanced, Reading, RecordedMotion
from rhythmid.identify.joints.reference_unit import reference_mend
from rhythmid.identify.plausibility import BETTER_UNIT, LEAST_UNIT_FACTOR
from rhythmid.record.joint_record import JointRecord
from rhythmid.report.quantity import number

Readings = tuple[Reading, ...]
CLEARLY = 0.5  # largest ratio of another reading's effort residual to that of the declared one
FLOOR = 0.01  # share of an effort below which residuals are not compared further
HELPS = 0.05  # least fall of the mean logarithm of the residuals for a change to be made and kept
# factors for rotational and for prismatic joints
POSITIONS = {True: (DEGREE, 1.0 / DEGREE), False: (1e-3, 1e3)}


def check_joints(machine: Machine, records: Sequence[JointRecord]) -> None:
    """Raise InputError with the likely correction where the efforts fit the body only with another order, unit or
    sign of recorded joints."""
    if (mend := likely_joint_mend(machine, records)) is not None:
        raise InputError(mend)


def likely_joint_mend(machine: Machine, records: Sequence[JointRecord]) -> str | None:
    """The likely wrong declaration of the joints and its correction, in one line; None where the efforts are
    plausible."""
    if not records:
        return None
    record = max(records, key=_moved)
    known = machine.body.joints
    turning = [joint not in known or known[joint].rotational for joint in record.joints]
    if (mend := reference_mend(record, turning)) is not None:
        return mend
    for touching in (False, True) if machine.body.contacts else (False,):
        motion = RecordedMotion(machine, record, touching)
        declared = motion.balanced(motion.as_declared)
        if all(one.left <= POOR_MOTION for one in declared):
            return None
        for free in (False, True):
            found = _searched(motion, free)
            if found != motion.as_declared and _convinces(motion, found, declared):
                return f"{record.name}: {_words(motion, found, declared)}"
    return None


def _moved(record: JointRecord) -> float:
    """Size of the joints' motion in a record, each in its own unit."""
    return float(sum(np.std(one.output.value) for one in record.joints.values()))


def _score(balanced: Iterable[Balanced]) -> float:
    """Mean logarithm of the effort residuals: the improvement of one joint counts, whatever the other joints do."""
    return float(np.mean([math.log(one.left + FLOOR) for one in balanced]))


def _searched(motion: RecordedMotion, free: bool) -> Readings:
    """The reading with the smallest effort residuals and only helpful changes; with `free`, with a factor for each
    effort."""

    def score(readings: Readings) -> float:
        return _score(motion.balanced(readings, free))

    best = motion.as_declared
    least = score(best)
    while True:
        tried = ((score(one), one) for one in _changed(motion, best, free))
        found, reading = min(tried, key=lambda one: one[0])
        if found > least - HELPS:
            tried = ((score(one), one) for one in _cycled(best))
            found, reading = min(tried, key=lambda one: one[0], default=(math.inf, best))
        if found > least - HELPS:
            break
        best, least = reading, found
    # an earlier change may not help any more after later ones
    for place, given in enumerate(motion.as_declared):
        for one in (
            replace(best[place], position=given.position),
            replace(best[place], effort=given.effort),
            replace(best[place], position=given.position, effort=given.effort),
        ):
            back = _with(best, place, one)
            if back != best and score(back) < least + HELPS:
                best, least = back, score(back)
    return _in_units(motion, best) if free else best


def _in_units(motion: RecordedMotion, readings: Readings) -> Readings:
    """The reading with a factor for each effort where that factor is no physical effect."""
    made = []
    for joint, one, found in zip(motion.joints, readings, motion.balanced(readings, True), strict=True):
        factor = 1.0 / found.gain if found.gain > 0.0 else 1.0
        foreign = not 1.0 / LEAST_UNIT_FACTOR < factor < LEAST_UNIT_FACTOR
        free = joint not in motion.computed
        made.append(replace(one, effort=one.effort * factor) if foreign and free else one)
    return tuple(made)


def _with(readings: Readings, place: int, one: Reading) -> Readings:
    return (*readings[:place], one, *readings[place + 1 :])


def _changed(motion: RecordedMotion, readings: Readings, free: bool) -> Iterator[Readings]:
    """Readings with one further change: of all joints, of one, or an exchange of two."""
    turned = [replace(one, effort=-one.effort) for one in readings]
    yield tuple(turned)
    yield tuple(replace(one, position=-one.position) for one in readings)
    for place in (0, 1):
        yield tuple(
            replace(one, position=one.position * POSITIONS[kind][place])
            for one, kind in zip(readings, motion.rotational, strict=True)
        )
    for place, one in enumerate(readings):
        sides = [(1.0, -1.0), (-1.0, 1.0), (-1.0, -1.0)]
        factors = [*sides, *((factor, 1.0) for factor in POSITIONS[motion.rotational[place]])]
        for position, effort in factors:
            changed = replace(one, position=one.position * position, effort=one.effort * effort)
            yield _with(readings, place, changed)
    for places in combinations(range(len(readings)), 2):
        yield _moved_round(readings, places)


def _cycled(readings: Readings) -> Iterator[Readings]:
    """Readings with three joints permuted cyclically."""
    for one, other, third in combinations(range(len(readings)), 3):
        yield _moved_round(readings, (one, other, third))
        yield _moved_round(readings, (one, third, other))


def _moved_round(readings: Readings, places: Sequence[int]) -> Readings:
    """The reading with the sources of some joints shifted cyclically by one."""
    made = list(readings)
    for place, following in zip(places, (*places[1:], places[0]), strict=True):
        made[place] = replace(readings[place], source=readings[following].source)
    return tuple(made)


def _convinces(motion: RecordedMotion, found: Readings, declared: Sequence[Balanced]) -> bool:
    """Whether a reading explains by the body what the declared one does not. An effort that a controller applies
    against the motion looks, with the opposite sign, like that of a spring and a damper."""
    left = motion.balanced(found)
    changed = [k for k, (one, own) in enumerate(zip(found, motion.as_declared, strict=True)) if one != own]
    before, after = (_rms(one.left for one in many) for many in (declared, left))
    return (
        after <= CLEARLY * before
        and all(left[k].left <= POOR_MOTION for k in changed)
        and max(left[k].left for k in changed) <= BETTER_UNIT * max(declared[k].left for k in changed)
        and _rms(left[k].left for k in changed) <= CLEARLY * _rms(left[k].bare for k in changed)
    )


def _rms(values: Iterable[float]) -> float:
    return float(np.sqrt(np.mean(np.square(list(values)))))


def _words(motion: RecordedMotion, found: Readings, declared: Sequence[Balanced]) -> str:
    joints, left = motion.joints, motion.balanced(found)
    said: list[str] = []
    moved = [
        f"{joint} is recorded as {joints[one.source]}"
        for joint, one in zip(joints, found, strict=True)
        if joints[one.source] != joint
    ]
    if moved:
        said.append(f"the joints seem to be recorded in another order: {', '.join(moved)}; correct 'joints:'")
    for channel in ("position", "effort"):
        factors: dict[str, dict[str, float]] = {}
        for joint, one, turns in zip(joints, found, motion.rotational, strict=True):
            factor = getattr(one, channel)
            if factor != 1.0:
                factors.setdefault(_guess(channel, factor, turns), {})[joint] = factor
        for guess, those in factors.items():
            roles = "'effort:'" if channel == "effort" else "'output:'"
            if channel == "position" and any(joint in motion.computed for joint in those):
                roles += " and 'input:'"
            names = "every joint" if len(those) == len(joints) else ", ".join(those)
            said.append(f"the {channel} of {names} {guess}; write  {_scale(those, joints)}  under {roles}")
    mirrored = tuple(replace(one, position=-one.position, effort=-one.effort) for one in found)
    if any(one.position < 0.0 for one in found) and _score(motion.balanced(mirrored)) < _score(left) + HELPS:
        said[-1] += " (or the same for the other joints: the mirrored machine moves alike)"
    worst = max(range(len(joints)), key=lambda k: declared[k].left - left[k].left)
    return (
        f"{'; '.join(said)} in signals.yaml. The body then leaves {100.0 * left[worst].left:.0f} % of the effort at {joints[worst]} "
        f"instead of {100.0 * declared[worst].left:.0f} %"
    )


def _scale(factors: Mapping[str, float], joints: Sequence[str]) -> str:
    """Text for signals.yaml that multiplies a channel of these joints by factors."""
    written = {joint: _factor(factor) for joint, factor in factors.items()}
    if len(written) == len(joints) and len(set(written.values())) == 1:
        return f"scale: {written[joints[0]]}"
    return f"scale: {{{', '.join(f'{joint}: {one}' for joint, one in written.items())}}}"


def _factor(factor: float) -> str:
    """A factor in the notation of signals.yaml."""
    exact = any(abs(abs(factor) / one - 1.0) < 1e-9 for one in (DEGREE, 1.0 / DEGREE))
    return f"{factor:.6g}" if exact else f"{float(f'{factor:.2g}'):g}"


def _guess(channel: str, factor: float, turns: bool) -> str:
    """What a channel that has to be multiplied by this factor seems to be, in words."""
    turned = " with its sign turned round" if factor < 0.0 else ""
    size = abs(factor)
    if size == 1.0:
        return "seems to have its sign turned round"
    unit = {("position", True): "rad", ("position", False): "m", ("effort", True): "N*m"}.get(
        (channel, turns), "N"
    )
    for known, name in UNITS[unit].items():
        if abs(size / known - 1.0) < NAMED:
            return f"looks like {name}{turned}, where {unit} is declared"
    times = f"{number(max(size, 1.0 / size), 1)} times too {'large' if size < 1.0 else 'small'}"
    return (
        f"seems to be in units about {times}{turned}, such as a motor's current in A where {unit} is declared"
    )
