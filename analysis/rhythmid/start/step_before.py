"""A step that was made as a record began, of the effort or of what was asked for: it stands still for the whole record."""

from collections.abc import Sequence

import numpy as np

from rhythmid.record.inventory import Recorded
from rhythmid.start.joint import Joint
from rhythmid.start.meaning import Quantity, force_unit_of, meaning_of

BEFORE = "it never changes: taken for a step that was made as the record began; without it, delete this input"
# of the way from where the output begins to a set point, that it keeps at most from the set point afterwards, rms: else it does not go there
LEFT = 0.5
DUTY = "1"  # the unit of a share of a supply's voltage
FIRST = 3  # samples by which it is told whether a machine starts from rest
SLOW = (
    0.2  # of the speed of the whole record, rms, that it then has at most: a machine that runs has all of it
)


def step_before(constant: Sequence[Recorded], joint: Joint) -> Recorded | None:
    """The one effort, by its name or unit, among what stands still at another value than zero; None where there is none or several."""
    efforts = [
        one for one in constant
        if (meaning := meaning_of(one)).quantity == "effort" and meaning.certain and joint.includes(one, meaning) and _is_known(one)
    ]  # fmt: skip
    return efforts[0] if len(efforts) == 1 else None


def set_point_before(
    constant: Sequence[Recorded], joint: Joint, output: Recorded, measured: Quantity
) -> Recorded | None:
    """The one set point of the output, among what stands still, to which the output goes from elsewhere; None where there is none or
    several."""
    asked = [
        one for one in constant
        if (meaning := meaning_of(one)).quantity == measured and meaning.commanded and meaning.certain
        and joint.includes(one, meaning) and np.isfinite(one.value).all() and _goes_to(output, float(one.value[0]))
    ]  # fmt: skip
    return asked[0] if len(asked) == 1 else None


def duty_before(
    constant: Sequence[Recorded], joint: Joint, output: Recorded, measured: Quantity
) -> Recorded | None:
    """The one duty of a motor's bridge, among what stands still, that is on while the output starts from rest; None where there is none or
    several.

    A voltage that stands still may be that of a supply, which drives nothing.
    """
    fed = [
        one for one in constant
        if force_unit_of(one) == DUTY and joint.includes(one, meaning_of(one)) and _is_known(one)
    ]  # fmt: skip
    return fed[0] if len(fed) == 1 and measured != "acceleration" and _starts(output, measured) else None


def _starts(output: Recorded, measured: Quantity) -> bool:
    """Whether an output is slow in its first samples beside what it becomes."""
    kept = np.isfinite(output.value)
    time, value = output.time[kept], output.value[kept]
    speed = np.abs(value if measured == "velocity" else np.gradient(value, time))
    first = float(np.median(speed[:FIRST]))
    return first < SLOW * float(np.sqrt(np.mean(speed**2)))


def _goes_to(output: Recorded, wanted: float) -> bool:
    """Whether an output begins far from this value and is near it afterwards, in the second half of its samples."""
    value = output.value[np.isfinite(output.value)]
    after = value[len(value) // 2 :] - wanted
    return bool(float(np.sqrt(np.mean(after**2))) < LEFT * abs(float(value[0]) - wanted))


def _is_known(one: Recorded) -> bool:
    """Whether it has a value, which is not zero."""
    return bool(np.isfinite(one.value).all() and one.value[:1].any())
