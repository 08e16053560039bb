"""Kind of a motion that no name tells: a speed where its balance needs a spring and no inertia.

A speed v that a damper d holds and a position x that a spring k holds against a damper follow what drives them by one law,
m v' + d v = d' x' + k x. Inertia and damper are two parts of every machine. The position needs a spring beside the damper, and
an inertia that does not show.
"""

from collections.abc import Callable
from dataclasses import replace

from rhythmid.errors import InputError
from rhythmid.record.inventory import Recorded
from rhythmid.start.balance import OF_THE_DRIVE
from rhythmid.start.meaning import letter_of, meaning_of, tells_unit
from rhythmid.start.nominal import Nominal
from rhythmid.start.roles import Roles

OF_ANY_OUTPUT = "y"  # beside an input u this letter stands for the output of a system, whatever its quantity
BY_LETTER = f"{OF_ANY_OUTPUT!r} usually stands for an output"
DOUBT = (
    "no name says whether it is a speed or a position: it follows what drives it as the speed of an inertia with a damper does; a position "
    "that a spring holds would do the same, without an inertia that shows: delete  kind: velocity  where it is one, and correct its unit"
)


def by_simpler_motion(
    roles: Roles, nominal: Nominal, tried: Callable[[Roles], Nominal]
) -> tuple[Roles, Nominal]:
    """The roles and the model with the output as a speed where nothing says that it is a position and the balance is the
    simpler one; else as given. `tried` returns the model for other roles."""
    output = roles.choices["output"]
    if (
        _is_told(output.recorded)
        or roles.output_kind != "position"
        or "velocity" in roles.choices
        or not nominal.massless
    ):
        return roles, nominal
    reason = BY_LETTER if _by_letter(output.recorded) else output.reason
    doubted = replace(output, reason=reason, doubts=(*output.doubts, DOUBT))
    changed = replace(roles, output_kind="velocity", choices={**roles.choices, "output": doubted})
    try:
        made = tried(changed)
    except InputError:
        return roles, nominal
    if made.explained is None or made.explained < (nominal.explained or 0.0) - OF_THE_DRIVE:
        return roles, nominal
    return changed, made


def _is_told(one: Recorded) -> bool:
    """Whether a name or a unit says which motion it is."""
    return tells_unit(one) or (meaning_of(one).quantity is not None and not _by_letter(one))


def _by_letter(one: Recorded) -> bool:
    """Whether nothing but the letter for any output names it."""
    return not meaning_of(one).certain and letter_of(one) == OF_ANY_OUTPUT
