"""Kind of a motion that no name tells: a speed where its balance needs a spring and no inertia.

A speed v that a damper d holds and a position x that a spring k holds against a damper follow what drives them by one law,
m v' + d v = d' x' + k x. Inertia and damper are two parts of every machine. The position needs a spring beside the damper, and
an inertia that does not show.
"""

from collections.abc import Callable
from dataclasses import replace

from rhythmid.errors import InputError
from rhythmid.start.balance import OF_THE_DRIVE
from rhythmid.start.meaning import meaning_of, tells_unit
from rhythmid.start.nominal import Nominal
from rhythmid.start.roles import Roles

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
    told = meaning_of(output.recorded).quantity is not None or tells_unit(output.recorded)
    if told or roles.output_kind != "position" or "velocity" in roles.choices or not nominal.massless:
        return roles, nominal
    doubted = replace(output, doubts=(*output.doubts, DOUBT))
    changed = replace(roles, output_kind="velocity", choices={**roles.choices, "output": doubted})
    try:
        made = tried(changed)
    except InputError:
        return roles, nominal
    if made.explained is None or made.explained < (nominal.explained or 0.0) - OF_THE_DRIVE:
        return roles, nominal
    return changed, made
