"""A step of the effort or the reference before the record began: the channel is constant over the whole record."""

from collections.abc import Collection, Sequence

import numpy as np

from rhythmid.record.inventory import Recorded
from rhythmid.start.joint import Joint
from rhythmid.start.meaning import force_unit_of, meaning_of
from rhythmid.start.vocabulary import Quantity

BEFORE = "it never changes: taken for a step that was made as the record began; without it, delete this input"
# largest rms distance from the set point afterwards, as a share of the initial distance, for an output that goes there
LEFT = 0.5
DUTY = "1"  # unit of a share of a supply's voltage
FIRST = 3  # samples that show whether a machine starts from rest
# largest share of the record's rms speed that it has in these samples: a running machine has all of it
SLOW = 0.2


def step_before(
    constant: Sequence[Recorded], joint: Joint, stepped: Collection[str] = ()
) -> tuple[Recorded, str] | None:
    """The one effort, by its name or unit, among the nonzero constants, and why; without one, the only constant without a
    meaning that is `stepped` from one recording to the next. None where there is none or several."""
    known = [
        (one, meaning) for one in constant if joint.includes(one, meaning := meaning_of(one)) and _is_known(one)
    ]  # fmt: skip
    efforts = [one for one, meaning in known if meaning.quantity == "effort" and meaning.certain]
    untold = [one for one, meaning in known if not meaning.certain and str(one) in stepped]
    if len(efforts) == 1:
        return efforts[0], "the only effort, and nothing else drives"
    if not efforts and len(untold) == 1:
        return untold[0], "it has another level in other recordings, and nothing else drives"
    return None


def set_point_before(
    constant: Sequence[Recorded], joint: Joint, output: Recorded, measured: Quantity
) -> Recorded | None:
    """The one set point of the output, among the constants, to which the output moves from another value; None
    where there is none or several."""
    for candidates in (_asked(constant, joint, measured), _asked_of_what(constant)):
        asked = [one for one in candidates if _missed(output, one) < LEFT]
        if asked:
            return asked[0] if len(asked) == 1 else None
    return None


def gone_to_set_point(
    constant: Sequence[Recorded], joint: Joint, outputs: Sequence[Recorded], measured: Quantity
) -> Recorded | None:
    """Of several measured motions, the one that comes nearest to the one set point among the constants; None where
    none goes to it, or there is not one set point."""
    asked = _asked(constant, joint, measured)
    if len(asked) != 1:
        return None
    nearest = min(outputs, key=lambda one: _missed(one, asked[0]))
    return nearest if _missed(nearest, asked[0]) < LEFT else None


def _asked(constant: Sequence[Recorded], joint: Joint, measured: Quantity) -> list[Recorded]:
    """The set points of a measured quantity among the constants."""
    return [
        one for one in constant
        if (meaning := meaning_of(one)).quantity == measured and meaning.commanded and meaning.certain
        and joint.includes(one, meaning) and np.isfinite(one.value).all()
    ]  # fmt: skip


def _asked_of_what(constant: Sequence[Recorded]) -> list[Recorded]:
    """The constants that were asked for, of which no name says what they are: `target`, `TargetCounts`."""
    return [
        one for one in constant
        if (meaning := meaning_of(one)).quantity is None and meaning.commanded and np.isfinite(one.value).all()
    ]  # fmt: skip


def duty_before(
    constant: Sequence[Recorded], joint: Joint, output: Recorded, measured: Quantity
) -> Recorded | None:
    """The one duty cycle of a motor's bridge, among the constants, that is on while the output starts from rest;
    None where there is none or several.

    A constant voltage may be that of a supply, which is no driving signal.
    """
    fed = [
        one for one in constant
        if force_unit_of(one) == DUTY and joint.includes(one, meaning_of(one)) and _is_known(one)
    ]  # fmt: skip
    return fed[0] if len(fed) == 1 and measured != "acceleration" and _starts(output, measured) else None


def _starts(output: Recorded, measured: Quantity) -> bool:
    """Whether an output is slow in its first samples compared with later."""
    kept = np.isfinite(output.value)
    time, value = output.time[kept], output.value[kept]
    speed = np.abs(value if measured == "velocity" else np.gradient(value, time))
    first = float(np.median(speed[:FIRST]))
    return first < SLOW * float(np.sqrt(np.mean(speed**2)))


def _missed(output: Recorded, asked: Recorded) -> float:
    """Rms distance of an output from a set point in the second half of its samples, relative to the initial distance;
    infinite where it starts there."""
    wanted = float(asked.value[0])
    value = output.value[np.isfinite(output.value)]
    after, first = value[len(value) // 2 :] - wanted, abs(float(value[0]) - wanted)
    return float(np.sqrt(np.mean(after**2))) / first if first > 0.0 else np.inf


def _is_known(one: Recorded) -> bool:
    """Whether it has a nonzero value."""
    return bool(np.isfinite(one.value).all() and one.value[:1].any())
