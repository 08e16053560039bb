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
from rhythmid.identify.joints.joint_reading import Balanced, Reading, RecordedMotion, mean_left
from rhythmid.identify.joints.mounting import likely_mounting
from rhythmid.identify.joints.reference_unit import reference_mend
from rhythmid.identify.plausibility import BETTER_UNIT, LEAST_UNIT_FACTOR
from rhythmid.identify.search_quality import POOR_MOTION
from rhythmid.record.joint_record import JointRecord
from rhythmid.report.quantity import number

Readings = tuple[Reading, ...]
CLEARLY = 0.5  # largest ratio of another reading's effort residual to that of the declared one
LEAST_EXPLAINED = 0.5  # least share of an effort's power that the body explains where a change of this joint alone is proposed
POSITION_CHANGE = 1.1  # weight of a change of positions: where a machine's mirror image moves alike, the effort's sign is the likelier change
HELPS = 0.05  # least fall of the mean logarithm of the residuals for each change
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
        told: list[tuple[float, str]] = []
        for free in (False, True):
            whole = _searched(motion, free)
            for one in (_told_alone(motion, whole), whole):
                if one != motion.as_declared and _convinces(motion, one, declared):
                    break
            else:
                one = _by_own_equation(motion, whole, declared)
            if one != motion.as_declared:
                told.append((_cost(motion, one), _words(record, motion, one, declared)))
        mounting = likely_mounting(motion)
        if mounting is not None and _fits(mounting.left, declared):
            words = f"{mounting.words()}. {_gain(motion, mounting.left, declared)}"
            told.append((mean_left(mounting.left) + HELPS, words))
        if told and _carried(motion, min(told)[0]):
            return None
        if told:
            return f"{record.name}: {min(told)[1]}"
    return None


def _carried(motion: RecordedMotion, cost: float) -> bool:
    """Whether a body that the last link of a chain carries explains the efforts of all joints at least as well as changes of this `cost` do.

    A hand on a light wrist multiplies the effort of its joint, as another unit would. The joints above feel the same hand.
    """
    loaded = (motion.loaded(link) for link in motion.body.ends)
    return any(left is not None and mean_left(left) + HELPS <= cost for left in loaded)


def _moved(record: JointRecord) -> float:
    """Size of the joints' motion in a record, each in its own unit."""
    return float(sum(np.std(one.output.value) for one in record.joints.values()))


def _changes(motion: RecordedMotion, readings: Readings) -> float:
    """How much a reading changes: what is the same at every joint is one change, an exchange of two joints is one."""
    moved = sum(one.place != own.place for one, own in zip(readings, motion.as_declared, strict=True))
    found = float((moved + 1) // 2)
    for channel, cost in (("position", POSITION_CHANGE), ("effort", 1.0)):
        made = [_sort(getattr(one, channel)) for one in readings]
        changed = len(made) - made.count("")
        found += cost * min([changed, *(1 + len(made) - made.count(kind) for kind in set(made) - {""})])
    return found


def _sort(factor: float) -> str:
    """What kind of change a factor is; nothing where it is none."""
    unit = "" if abs(factor) == 1.0 else f"{math.log10(abs(factor)):.0f}"
    return f"-{unit}" if factor < 0.0 else unit


def _cost(motion: RecordedMotion, readings: Readings, free: bool = False) -> float:
    """Mean logarithm of the residuals under a reading, plus the fall that its changes have to bring."""
    return mean_left(motion.balanced(readings, free)) + HELPS * _changes(motion, readings)


def _searched(motion: RecordedMotion, free: bool) -> Readings:
    """The reading with the smallest effort residuals and only helpful changes; with `free`, with a factor for each
    effort."""

    def score(readings: Readings) -> float:
        return _cost(motion, readings, free)

    best = motion.as_declared
    least = score(best)
    while True:
        tried = ((score(one), one) for one in _changed(motion, best))
        found, reading = min(tried, key=lambda one: one[0])
        if found >= least:
            tried = ((score(one), one) for one in _cycled(best))
            found, reading = min(tried, key=lambda one: one[0], default=(math.inf, best))
        if found >= least:
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
            if back != best and score(back) < least:
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


def _changed(motion: RecordedMotion, readings: Readings) -> Iterator[Readings]:
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
        if not any(motion.joints[place] in motion.computed for place in places):
            yield _moved_round(readings, places, efforts=False)
            yield _moved_round(readings, places, motions=False)


def _cycled(readings: Readings) -> Iterator[Readings]:
    """Readings with three joints permuted cyclically."""
    for one, other, third in combinations(range(len(readings)), 3):
        yield _moved_round(readings, (one, other, third))
        yield _moved_round(readings, (one, third, other))


def _moved_round(
    readings: Readings, places: Sequence[int], motions: bool = True, efforts: bool = True
) -> Readings:
    """The reading with the motions and efforts of some joints, or one of the two, shifted cyclically by one."""
    made = list(readings)
    for place, following in zip(places, (*places[1:], places[0]), strict=True):
        own, other = readings[place], readings[following]
        made[place] = replace(
            own,
            source=other.source if motions else own.source,
            driven=other.driven if efforts else own.driven,
        )
    return tuple(made)


def _told_alone(motion: RecordedMotion, found: Readings) -> Readings:
    """The reading without what it changes at joints of which the body tells too little; changes that most joints have stay together."""
    kinds = [(_sort(one.position), _sort(one.effort)) for one in found]
    return tuple(
        one
        if known.told >= LEAST_EXPLAINED or one.place != own.place or 2 * kinds.count(kind) > len(found)
        else own
        for one, own, known, kind in zip(
            found, motion.as_declared, motion.balanced(found), kinds, strict=True
        )
    )


def _by_own_equation(motion: RecordedMotion, found: Readings, declared: Sequence[Balanced]) -> Readings:
    """The reading with what it changes at joints whose own equation tells it, whatever is left at the others.

    The factor of an effort stands in the equation of its own joint alone. As declared, the body explains nothing of
    that effort; with the factor it explains most of it, beyond what losses do. What is left may be large, because
    friction or a load may be missing, but not where the factor is a unit, which such a part could imitate. Positions
    stand in the equations of all joints, so their changes are judged together.
    """
    given = motion.as_declared
    if any(replace(one, effort=own.effort) != own for one, own in zip(found, given, strict=True)):
        return given
    return tuple(
        one
        if known.told >= LEAST_EXPLAINED
        and was.told == 0.0
        and known.left <= BETTER_UNIT * was.left
        and (abs(one.effort) == 1.0 or known.left <= POOR_MOTION)
        else own
        for one, own, known, was in zip(found, given, motion.balanced(found), declared, strict=True)
    )


def _convinces(motion: RecordedMotion, found: Readings, declared: Sequence[Balanced]) -> bool:
    """Whether a reading explains by the body what the declared one does not. An effort that a controller applies
    against the motion looks, with the opposite sign, like that of a spring and a damper."""
    left = motion.balanced(found)
    changed = [k for k, (one, own) in enumerate(zip(found, motion.as_declared, strict=True)) if one != own]
    before, after = (_rms(one.left for one in many) for many in (declared, left))
    return _explains(left, declared) or (
        after <= CLEARLY * before
        and all(left[k].left <= POOR_MOTION for k in changed)
        and max(left[k].left for k in changed) <= BETTER_UNIT * max(declared[k].left for k in changed)
        and _rms(left[k].left for k in changed) <= CLEARLY * _rms(left[k].bare for k in changed)
    )


def _fits(left: Sequence[Balanced], declared: Sequence[Balanced]) -> bool:
    """Whether what is no fault of one joint explains the efforts of all of them."""
    before, after = (_rms(one.left for one in many) for many in (declared, left))
    well = after <= CLEARLY * before and all(one.left <= POOR_MOTION for one in left)
    return well or _explains(left, declared)


def _explains(left: Sequence[Balanced], declared: Sequence[Balanced]) -> bool:
    """Whether the body explains the efforts of all joints together, and as declared explains hardly any.

    A joint counts by what the body has to say of it: one that carries no weight moves by friction under any reading.
    """
    told, before = ([one.told for one in many] for many in (left, declared))
    if sum(told) < 1.0 or sum(before) > CLEARLY * sum(told):
        return False
    weighted = math.sqrt(sum(share * one.left**2 for share, one in zip(told, left, strict=True)) / sum(told))
    return weighted <= CLEARLY


def _rms(values: Iterable[float]) -> float:
    return float(np.sqrt(np.mean(np.square(list(values)))))


def _words(record: JointRecord, motion: RecordedMotion, found: Readings, declared: Sequence[Balanced]) -> str:
    joints, left = motion.joints, motion.balanced(found)
    said = list(_orders(joints, found))
    for channel in ("position", "effort"):
        factors: dict[str, dict[str, float]] = {}
        for joint, one, turns in zip(joints, found, motion.rotational, strict=True):
            factor = getattr(one, channel)
            if factor != 1.0:
                factors.setdefault(_guess(channel, factor, turns), {})[joint] = factor
        if not factors:
            continue
        clauses = [
            f"{'every joint' if len(those) == len(joints) else ', '.join(those)} {guess}"
            for guess, those in factors.items()
        ]
        every = {joint: factor for those in factors.values() for joint, factor in those.items()}
        roles = "'effort:'" if channel == "effort" else "'output:'"
        if channel == "position" and any(joint in motion.computed for joint in every):
            roles += " and 'input:'"
        scales = record.scales.get("output" if channel == "position" else "effort", {})
        wanted = {joint: every.get(joint, 1.0) * scales.get(joint, 1.0) for joint in joints}
        wanted = {joint: one for joint, one in wanted.items() if joint in every or one != 1.0}
        instead = " in place of the scale that is there" if any(one != 1.0 for one in scales.values()) else ""
        said.append(
            f"the {channel} of {', that of '.join(clauses)}; write  {_scale(wanted, joints)}  under {roles}{instead}"
        )
    mirrored = tuple(replace(one, position=-one.position, effort=-one.effort) for one in found)
    if (
        any(one.position < 0.0 for one in found)
        and mean_left(motion.balanced(mirrored)) < mean_left(left) + HELPS
    ):
        said[-1] += " (or the same for the other joints: the mirrored machine moves alike)"
    return f"{'; '.join(said)} in signals.yaml. {_gain(motion, left, declared)}"


def _orders(joints: Sequence[str], found: Readings) -> Iterator[str]:
    """What is recorded in another order, and where to correct it."""
    for what, place, where in (
        (
            "joints seem",
            [one.source if one.source == one.driven else k for k, one in enumerate(found)],
            "correct 'joints:'",
        ),
        (
            "positions alone seem",
            [one.source if one.source != one.driven else k for k, one in enumerate(found)],
            "list its columns in the order of 'joints:' under 'output:'",
        ),
        (
            "efforts alone seem",
            [one.driven if one.source != one.driven else k for k, one in enumerate(found)],
            "list its columns in the order of 'joints:' under 'effort:'",
        ),
    ):
        moved = [
            f"{joint} is recorded as {joints[at]}"
            for joint, at in zip(joints, place, strict=True)
            if joints[at] != joint
        ]
        if moved:
            yield f"the {what} to be recorded in another order: {', '.join(moved)}; {where}"


def _gain(motion: RecordedMotion, left: Sequence[Balanced], declared: Sequence[Balanced]) -> str:
    """How much less of an effort is left at the joint where this is most."""
    worst = max(range(len(left)), key=lambda k: declared[k].left - left[k].left)
    return (
        f"The body then leaves {100.0 * left[worst].left:.0f} % of the effort at {motion.joints[worst]} "
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
