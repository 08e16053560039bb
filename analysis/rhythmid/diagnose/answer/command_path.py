"""Laws of the command path that are observationally equivalent to laws of the actuator, where the recorded effort is a command.

A lag of the command and one of the actuator differ in what else drives: a forcing on the robot passes through the actuator
alone. Where nothing else drives, they are one law. An effort that was measured has the command path behind it, and shows nothing of it.
"""

from collections.abc import Mapping, Sequence

from rhythmid.elements.catalogue import Catalogue
from rhythmid.identify.drive import controlled
from rhythmid.model import Model
from rhythmid.record.record import Record

Groups = tuple[tuple[str, ...], ...]


def equivalents_in_command_path(
    records: Sequence[Record], model: Model, catalogue: Catalogue
) -> Mapping[str, str]:
    """The element of the command path that does here what one of the actuator does, by the name of that one.

    Two elements do the same where they share a kernel.
    """
    commanded = all(
        one.input is not None and one.hold == "zero" and one.effort is None and one.forcing is None
        for one in records
    )
    if not commanded or controlled(model):
        return {}
    of_command = {one.kernel: one.name for one in catalogue.values() if one.slot == "command" and one.kernel}
    return {
        one.name: of_command[one.kernel]
        for one in catalogue.values()
        if one.slot == "actuator" and one.kernel is not None and one.kernel in of_command
    }


def with_equivalents(groups: Groups, named: Sequence[str], equivalents: Mapping[str, str]) -> Groups:
    """The groups of indistinguishable laws, with the equivalents of those that are named."""
    found = [(*group, *(equivalents[name] for name in group if name in equivalents)) for group in groups]
    alone = [name for name in named if name in equivalents and not any(name in group for group in groups)]
    return (*found, *((name, equivalents[name]) for name in alone))
