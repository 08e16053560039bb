"""Another measured effort than the one that was chosen, where the balance of forces tells that this one drives the motion.

A torque behind a gear or at a link may have next to nothing to do with what its motor's current does to the motion; names do not tell it.
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

EXPLAINED = (
    0.5  # share of an effort that its balance has to explain, to be taken before one that names prefer
)


def by_other_effort(
    found: Inventory, roles: Roles, nominal: Nominal, tried: Callable[[Roles], Nominal]
) -> tuple[Roles, Nominal]:
    """The roles and the model with that other effort of which the balance explains most, `tried` out; as given where the chosen one balances,
    or no other one does."""
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
    """The role that the balance takes for what drives."""
    return "effort" if "effort" in roles.choices else "input"


def _others(found: Inventory, roles: Roles) -> Iterator[Recorded]:
    """Efforts that were measured, of the joint, and that play no role."""
    taken = {id(choice.recorded) for choice in roles.choices.values()}
    for one in found.recorded:
        meaning = meaning_of(one)
        measured = meaning.quantity == "effort" and meaning.certain and meaning.commanded is not True
        if id(one) not in taken and measured and not meaning.forcing and roles.joint.includes(one, meaning):
            yield one


def _with(roles: Roles, other: Recorded) -> Roles:
    """The roles with another effort; a command that is not in its unit is left out."""
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
