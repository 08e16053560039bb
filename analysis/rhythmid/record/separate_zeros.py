"""Records of one machine whose positions are far apart, for example because an encoder was zeroed at another position."""

from collections.abc import Sequence

import numpy as np

from rhythmid.record.record import Record


def separate_zeros_notes(records: Sequence[Record]) -> tuple[str, ...]:
    """A line on each record whose position differs from that of the first by more than the motion of either; empty
    where none does.

    Only for positions of a single joint: other quantities, such as a speed, have no zero that a user chooses.
    """
    plain = [one for one in records if isinstance(one, Record) and one.output_kind == "position"]
    if not plain:
        return ()
    first, *others = plain
    low, high = _range(first)
    found: list[str] = []
    for other in others:
        begin, end = _range(other)
        apart = max(begin - high, low - end)
        if apart > max(high - low, end - begin):
            unit = other.output.unit
            found.append(
                f"the output of {other.name} is between {begin:.4g} and {end:.4g} {unit}, far from that of {first.name}, {low:.4g} to "
                f"{high:.4g} {unit}: where a spring or gravity acts, was it zeroed elsewhere? An  offset:  in its signals mends that"
            )
    return tuple(found)


def _range(record: Record) -> tuple[float, float]:
    value = record.output.value
    return float(np.min(value)), float(np.max(value))
