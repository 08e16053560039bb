"""Quality of the recordings: a section of every report."""

from collections.abc import Sequence
from dataclasses import dataclass

from rhythmid.record.record import Record
from rhythmid.report.blocks import Block, Bullets, Paragraph, Section, Table
from rhythmid.report.quantity import NONE, number, scaled, with_unit


@dataclass(frozen=True)
class RecordQuality:
    """Properties of one record that a reader should know before trusting a result. None: not known.

    `duration` [s], `rate` [Hz] and `jitter` (standard deviation of the time between samples [s]) refer to the output.
    """

    name: str
    role: str
    channels: tuple[str, ...]
    duration: float
    rate: float
    jitter: float | None = None
    gaps: int | None = None
    lost: int | None = None
    clipped: int | None = None
    warnings: tuple[str, ...] = ()


def quality_of(record: Record, role: str) -> RecordQuality:
    """Quality of a record; `role` states its use."""
    known = record.quality if "output" in record.quality.channels else None
    return RecordQuality(
        name=record.name,
        role=role,
        channels=tuple(record.channels),
        duration=record.duration,
        rate=1.0 / record.output.period,
        jitter=known.jitter_std if known else None,
        gaps=known.gaps if known else None,
        lost=known.lost if known else None,
        clipped=known.clipped if known else None,
        warnings=tuple(record.quality.warnings()) if known else tuple(record.quality.notes),
    )


def quality_section(records: Sequence[RecordQuality]) -> Section:
    """How good the recordings are."""
    rows = []
    for one in records:
        jitter = NONE
        if one.jitter is not None:
            factor, unit = scaled(one.jitter, "s")
            jitter = with_unit(number(factor * one.jitter, 3), unit) if one.jitter > 1e-12 else "none"
        rows.append(
            (
                one.name, one.role, ", ".join(one.channels),
                f"{with_unit(number(one.duration, 3), 's')} at {with_unit(number(one.rate, 5), 'Hz')}", jitter, _count(one.gaps, f" ({one.lost or 0} samples lost)"),
                _count(one.clipped, " samples"),
            )
        )  # fmt: skip
    columns = ("record", "used for", "channels", "length", "jitter (std)", "gaps of the output", "clipped")
    warnings = tuple(f"{one.name}: {line}" for one in records for line in one.warnings)
    remarks: Block = Bullets(warnings) if warnings else Paragraph("No remarks.", "note")
    return Section(
        "Quality of the records", (Table("As read, before any averaging.", columns, tuple(rows)), remarks)
    )


def _count(value: int | None, what: str) -> str:
    return NONE if value is None else "none" if value == 0 else f"{value}{what}"
