"""Message where no recorded number is named as a motion: how each number was interpreted, and how to name one."""

import json
from collections.abc import Sequence

from rhythmid.errors import InputError
from rhythmid.start.role_choice import Known
from rhythmid.start.words import words_of

LISTED = 12  # largest number of numbers in the message
AMBIGUOUS = frozenset(
    {"current", "currents"}
)  # of a name without a unit: amperes, or the present value of a quantity


class NoMotionError(InputError):
    """No recorded number can be a motion."""


def no_motion(known: Sequence[Known]) -> str:
    """The message, in one line."""
    listed = "; ".join(f"{one.one} ({_taken_for(one)})" for one in known[:LISTED])
    more = f" and {len(known) - LISTED} more" if len(known) > LISTED else ""
    measured = [one.one for one in known if one.meaning.commanded is not True]
    if not measured:
        return (
            f"no position, velocity or acceleration is measured; as far as names say, all of it was asked for: {listed}{more}. Record the "
            "motion, too, such as joint states, odometry or an IMU, or rename what was measured"
        )
    able = [one.one for one in known if AMBIGUOUS & set(words_of(one.one.said)) and not one.one.unit]
    present = "; 'current' may mean amperes, or what is measured at present" if able else ""
    one = able[0] if able else measured[0]
    where = (
        f"topic: {one.topic}, field: {json.dumps(one.field)}"
        if one.topic
        else f"column: {json.dumps(one.column)}"
    )
    return (
        f"no position, velocity or acceleration is measured, as far as names say: {listed}{more}{present}. Rename the column that is one, "
        f"such as to wheel_velocity, or write signals.yaml with it:  output: {{{where}, kind: velocity, unit: rad/s}}"
    )


def _taken_for(one: Known) -> str:
    """Interpretation of a number, and its reason."""
    what = one.quantity or ("asked for" if one.meaning.commanded else "not understood")
    return f"{what}: {one.meaning.reason}" if one.meaning.reason else what
