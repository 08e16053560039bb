"""Other effects that give the same force as a stated one while the machine moves, so that only its rests separate them."""

from rhythmid.model import Term
from rhythmid.report.quantity import with_written_unit


def same_while_moving(term: Term | None, where: str = "") -> tuple[str, ...]:
    """A sentence with the sizes of the other effects; empty for an effect of which none are known. `where` is the joint of a machine."""
    if term is None or term.element.moving_as is None:
        return ()
    unit = next(value.unit for name, value in term.values.items() if name == term.element.size)
    others = " and ".join(
        f"{name} of {with_written_unit(f'{size:.3g}', unit)}"
        for name, size in term.element.moving_as(**term.numbers)
    )
    return (
        f"{where}{term.label}: while the machine moves this is the same as {others}, such as a weight or a zero of the effort. Only rests "
        "under several efforts separate them.",
    )
