"""Choice of a command instead of a measured effort in another unit: the model has one unit of force, which is that of the
measured effort unless the balance of forces shows that the command is closer to what moves the machine.

A bus reports a motor's current in coarse steps and late, and the duty of its bridge exactly.
"""

from collections.abc import Callable
from dataclasses import replace

from rhythmid.errors import InputError
from rhythmid.start.balance import EARNS_PLACE, OF_THE_DRIVE
from rhythmid.start.force_unit import doubt_of_units
from rhythmid.start.nominal import Nominal
from rhythmid.start.role_choice import Choice
from rhythmid.start.roles import Roles


def by_command_alone(
    roles: Roles, nominal: Nominal, tried: Callable[[Roles], Nominal]
) -> tuple[Roles, Nominal]:
    """The roles and the model without the measured effort where the command is in another unit and its balance leaves clearly less
    of it; else as given. `tried` returns the model for other roles."""
    command, effort = (roles.choices.get(role) for role in ("input", "effort"))
    if command is None or effort is None or nominal.explained is None:
        return roles, nominal
    if not (doubt := doubt_of_units(command.recorded, effort.recorded)):
        return roles, nominal
    alone = _alone(roles, command, effort, doubt)
    try:
        made = tried(alone)
    except InputError:
        return roles, nominal
    if made.explained is None:
        return roles, nominal
    left, leaves = 1.0 - nominal.explained, 1.0 - made.explained
    if leaves >= EARNS_PLACE * left or left - leaves < OF_THE_DRIVE:
        return roles, nominal
    note = (
        f"{effort.recorded} is left out, because {command.recorded} is in another unit and the model has one unit of force: the balance of "
        f"forces explains {made.explained:.0%} of {command.recorded}, and {max(nominal.explained, 0.0):.0%} of {effort.recorded}"
    )
    return replace(alone, notes=(*roles.notes, note)), made


def _alone(roles: Roles, command: Choice, effort: Choice, doubt: str) -> Roles:
    """The roles with the command alone, beside a reference as the effort of its controller."""
    choices = {role: one for role, one in roles.choices.items() if role not in ("input", "effort")}
    doubts = tuple(one for one in command.doubts if one != doubt)
    kept = replace(command, others=(*command.others, effort.recorded), doubts=doubts)
    return replace(roles, choices={**choices, "effort" if "reference" in choices else "input": kept})
