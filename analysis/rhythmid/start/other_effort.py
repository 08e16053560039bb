"""Choice of another measured effort if the balance of forces shows that it drives the motion and the chosen one does not.

Names do not show this: a torque measured behind a gear may be almost unrelated to the motion that the motor's current causes.
"""

from collections.abc import Callable, Iterator
from dataclasses import replace

from rhythmid.errors import InputError
from rhythmid.record.inventory import Inventory, Recorded
from rhythmid.start.balanced import UNEXPLAINED
from rhythmid.start.force_unit import doubt_of_units
from rhythmid.start.meaning import meaning_of
from rhythmid.start.nominal import Nominal
from rhythmid.start.role_choice import Choice
from rhythmid.start.roles import Roles

EXPLAINED = 0.5  # least share of another effort that its balance explains, for it to replace the effort chosen by name


def by_other_effort(
    found: Inventory, roles: Roles, nominal: Nominal, tried: Callable[[Roles], Nominal]
) -> tuple[Roles, Nominal]:
    """The roles and the model with the effort that is best explained by the balance of forces; as given if the chosen effort is explained,
    or no other one is. `tried` returns the model for other roles."""
    balanced = nominal.explained is None or nominal.explained >= 1.0 - UNEXPLAINED
    if balanced or roles.input_kind != "force":
        return roles, nominal
    able: list[tuple[float, Roles, Nominal]] = []
    for other in _others(found, roles):
        changed = _with(roles, other)
        try:
            made = tried(changed)
        except InputError:
            continue
        if made.explained is not None and made.explained >= EXPLAINED:
            able.append((made.explained, changed, made))
    if not able:
        return roles, nominal
    share, best, made = max(able, key=lambda one: one[0])
    role = _driver(best)
    was, choice = roles.choices[_driver(roles)].recorded, best.choices[role]
    reason = (
        f"the balance of forces explains {share:.0%} of it, and {max(nominal.explained or 0.0, 0.0):.0%} of {was}, which its name would make the "
        "effort"
    )
    return replace(best, choices={**best.choices, role: replace(choice, reason=reason)}), made


def _driver(roles: Roles) -> str:
    """The role of the signal that drives the machine in the balance."""
    return "effort" if "effort" in roles.choices else "input"


def _others(found: Inventory, roles: Roles) -> Iterator[Recorded]:
    """Measured efforts of the joint without a role."""
    taken = {id(choice.recorded) for choice in roles.choices.values()}
    for one in found.recorded:
        meaning = meaning_of(one)
        measured = meaning.quantity == "effort" and meaning.certain and meaning.commanded is not True
        if id(one) not in taken and measured and not meaning.forcing and roles.joint.includes(one, meaning):
            yield one


def _with(roles: Roles, other: Recorded) -> Roles:
    """The roles with another effort; a command in another unit is left out."""
    role, choices = _driver(roles), dict(roles.choices)
    was = choices.pop(role)
    others = [was.recorded, *(one for one in was.others if one is not other)]
    command = choices.get("input")
    if command is not None and doubt_of_units(command.recorded, other):
        others.append(choices.pop("input").recorded)
    if "input" not in choices and "reference" not in choices:
        role = "input"
    choices[role] = Choice(other, "", tuple(others))
    return replace(roles, choices=choices)
