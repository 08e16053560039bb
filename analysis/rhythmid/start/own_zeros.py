"""Zeros that differ from record to record of a free motion, as where an encoder is zeroed before each recording.

No force brings such motions back to one place, so that a common balance would show neither a spring nor gravity.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace

from rhythmid.errors import InputError
from rhythmid.record.record import Record
from rhythmid.start.balance import Law
from rhythmid.start.balanced import rest_of
from rhythmid.start.correction import Correction


def own_zeros_of(
    records: Sequence[Record], law: Law, balance: Callable[[Sequence[Record]], tuple[Law, str]]
) -> tuple[Correction, ...]:
    """Offsets with which all records rest where the first does, as one correction; none where they have one zero.

    `law` is the balance of all records; `balance` gives that of some of them and the kind of its restoring force. The offsets follow from where
    each record comes to rest alone, and are needed if the balance of all is clearly better with them.
    """
    if len(records) < 2 or any(one.output_kind != "position" for one in records):
        return ()
    rests: dict[str, float] = {}
    for one in records:
        try:
            rest = rest_of(*balance([one]))
        except InputError:
            continue
        if rest is not None:
            rests[one.name] = rest
    if len(rests) < 2:
        return ()
    first = next(iter(rests.values()))
    offsets = {one.name: float(f"{first - rests.get(one.name, first):.4g}") for one in records}
    moved = [
        replace(one, output=replace(one.output, value=one.output.value + offsets[one.name]))
        for one in records
    ]
    if not balance(moved)[0].earns_place(law):
        return ()
    unit = records[0].output.unit
    told = ", ".join(f"{name} by {-offset:.3g} {unit}" for name, offset in offsets.items() if offset)
    why = f"the records rest at different places, {told} from the others, as where an encoder is zeroed before each: an offset for each is written"
    return (Correction("output", why, offsets=offsets),)
