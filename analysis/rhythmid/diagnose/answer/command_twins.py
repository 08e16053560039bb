"""Laws of the command path that are equal to laws of the actuator, where the effort that was recorded is a command.

A lag of the command and one of the actuator differ in what else drives: a forcing on the robot passes through the actuator
alone. Where nothing else drives, they are one law. An effort that was measured has the command path behind it, and shows nothing of it.
"""

from collections.abc import Mapping, Sequence

from rhythmid.elements.catalogue import Catalogue
from rhythmid.elements.element import Element
from rhythmid.identify.drive import controlled
from rhythmid.model import Model
from rhythmid.record.record import Record

Groups = tuple[tuple[str, ...], ...]


def command_twins(records: Sequence[Record], model: Model, catalogue: Catalogue) -> Mapping[str, str]:
    """The elements of the command path that do here what one of the actuator does, by the name of that one."""
    commanded = all(
        one.input is not None and one.hold == "zero" and one.effort is None and one.forcing is None
        for one in records
    )
    if not commanded or controlled(model):
        return {}
    commands = [one for one in catalogue.values() if one.slot == "command"]
    return {
        one.name: twin.name
        for one in catalogue.values()
        if one.slot == "actuator"
        for twin in commands
        if _same_law(one, twin)
    }


def _same_law(one: Element, other: Element) -> bool:
    if one.kernel is None or other.kernel is None or one.borrows != other.borrows:
        return False
    units = ([(p.name, p.unit) for p in each.parameters] for each in (one, other))
    code = (each.__code__ for each in (one.kernel, other.kernel))
    first, second = ((c.co_code, c.co_consts, c.co_varnames) for c in code)
    return next(units) == next(units) and first == second


def with_twins(groups: Groups, named: Sequence[str], twins: Mapping[str, str]) -> Groups:
    """The groups of indistinguishable laws, with the twins of those that are named."""
    found = [(*group, *(twins[name] for name in group if name in twins)) for group in groups]
    alone = [name for name in named if name in twins and not any(name in group for group in groups)]
    return (*found, *((name, twins[name]) for name in alone))
