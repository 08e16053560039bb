"""What the user says of the channels of a recording: the roles of some, and units that no heading tells."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import cast, get_args

from rhythmid.errors import InputError
from rhythmid.record.heading import unit_of
from rhythmid.record.inventory import Inventory, Recorded, StatedRole
from rhythmid.start.vocabulary import BY_UNIT

ROLES: tuple[StatedRole, ...] = get_args(StatedRole)
DRIVES: frozenset[StatedRole] = frozenset(("input", "reference", "base", "forcing"))


@dataclass(frozen=True)
class Stated:
    """The channel of each stated role, and the units of channels, by the name that a heading or `rhythmid init` gives them."""

    roles: Mapping[StatedRole, str] = field(default_factory=dict)
    units: Mapping[str, str] = field(default_factory=dict)

    @classmethod
    def of(cls, roles: Sequence[str], units: Sequence[str]) -> "Stated":
        """From `ROLE=CHANNEL` and `CHANNEL=UNIT`. Raises InputError where one is written otherwise, or a role is unknown."""
        given = dict(_split(one, "ROLE=CHANNEL", first=True) for one in roles)
        for role in given:
            if role not in ROLES:
                raise InputError(f"--role {role}={given[role]}: a role is one of {', '.join(ROLES)}")
        if len(given) < len(roles):
            raise InputError("--role: a role is given twice; each has one channel")
        named = dict(_split(one, "CHANNEL=UNIT", first=False) for one in units)
        return cls(cast(Mapping[StatedRole, str], given), named)

    def told(self, found: Inventory) -> Inventory:
        """The inventory with what is stated of its channels.

        Raises InputError where it has no such channel, a channel with a role never changes, a unit is unknown, or an input is in a unit of a
        motion.
        """
        if not self.roles and not self.units:
            return found
        for channel, unit in self.units.items():
            found = _with(found, _in_unit(_channel(found, channel, "--unit"), unit))
        for role, channel in self.roles.items():
            one = _channel(found, channel, f"--role {role}=")
            if any(one is each for each in found.angles):
                found = replace(found, recorded=(*found.recorded, one))
            if all(one is not each for each in found.recorded):
                step = "; a set point to which the output goes is found without it" if role in DRIVES else ""
                raise InputError(f"{found.path}: {one} never changes, so that it cannot be the {role}{step}")
            if role in ("input", "forcing") and BY_UNIT.get(one.unit, "effort") != "effort":
                raise InputError(
                    f"{found.path}: {one} is in {one.unit}, which is no force; say  reference={channel}  where a controller follows it, or  "
                    f"base={channel}  where it is the motion of the base"
                )
            found = _with(found, replace(one, stated=role))
        return found


def _split(text: str, form: str, first: bool) -> tuple[str, str]:
    before, equals, after = text.partition("=") if first else text.rpartition("=")
    if not equals or not before.strip() or not after.strip():
        raise InputError(f"{text!r} is not  {form}")
    return before.strip(), after.strip()


def _channel(found: Inventory, name: str, option: str) -> Recorded:
    every = (*found.recorded, *found.constant, *found.angles)
    for spelled in (str, lambda one: one.column, lambda one: one.said):
        matches = [one for one in every if spelled(one) == name]
        if len(matches) == 1:
            return matches[0]
    listed = ", ".join(str(one) for one in found.recorded)
    raise InputError(f"{found.path}: no channel is called {name!r} ({option}); it has {listed}")


def _in_unit(one: Recorded, unit: str) -> Recorded:
    known = unit_of(unit)
    if known is None:
        raise InputError(
            f"--unit {one}={unit}: the unit is not known; write it as in a heading, such as deg, rpm or N*m"
        )
    si, scale = known
    return replace(one, unit=si, scale=scale, written_unit=unit, value=one.value / one.scale * scale)


def _with(found: Inventory, changed: Recorded) -> Inventory:
    def swapped(channels: Sequence[Recorded]) -> Iterator[Recorded]:
        return (changed if str(one) == str(changed) else one for one in channels)

    return replace(
        found,
        recorded=tuple(swapped(found.recorded)),
        constant=tuple(swapped(found.constant)),
        listed=tuple(swapped(found.listed)),
    )


NOTHING = Stated()
