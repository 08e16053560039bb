"""Units in the headings of a table that its signals.yaml ignores."""

from rhythmid.record.heading import heading_of
from rhythmid.record.signals import Signals


def unit_notes(signals: Signals, dated: bool) -> tuple[str, ...]:
    """A note on every column whose heading has a unit that is not SI and that is read without a scale; none on a time that is `dated`:
    it is in seconds, whatever its heading says."""
    read: list[tuple[str, str | int, float]] = [
        (role, source.column, source.scale) for role, source in signals.channels.items()
    ]
    if signals.time.kind == "column" and not dated:
        read.append(("time", signals.time.column, signals.time.scale))
    found: list[str] = []
    for role, column, scale in read:
        heading = heading_of(str(column))
        if heading.converted and scale == 1.0:
            unit = "" if role == "time" else f", unit: {heading.unit}"
            found.append(
                f"{role}: column {str(column)!r} is in {heading.written} by its heading, but is read as it is; "
                f"write  scale: {heading.scale:.10g}{unit}"
            )
    return tuple(found)
