"""The line of signals.yaml for the part of each record in which the machine moves freely."""

import json
import math
from collections.abc import Sequence
from pathlib import Path

from rhythmid.errors import InputError
from rhythmid.record.cleaning import cleaned
from rhythmid.record.free_motion import Freed, freed
from rhythmid.record.read import read_record
from rhythmid.record.record import Record
from rhythmid.record.rest_at_ends import rests_of
from rhythmid.record.signals import Signals


def free_parts(sources: Sequence[str | Path], signals: Signals) -> tuple[str, tuple[str, ...]]:
    """The line, and a message on each record but the first that is not free from its start; an empty line where all are."""
    records = [one for source in sources if (one := _read(source, signals)) is not None]
    free = {one.name: found for one in records if (found := freed(one)) is not None}
    if not free:
        return "", ()
    parts = {one.name: _part(one, free.get(one.name)) for one in records}
    notes = tuple(f"{one.name}: {said}" for one in records[1:] if one.name in free for said in rests_of(one))
    if len(sources) == 1:
        return f"use: {parts[records[0].name]}", notes
    return f"use: {{{', '.join(f'{json.dumps(name)}: {part}' for name, part in parts.items())}}}", notes


def _part(record: Record, free: Freed | None) -> str:
    """The free part of a record, all of it where that is None, on the clock of `use:`."""
    time, zero = record.output.time, record.use_zero
    begin, end = (None, None) if free is None else (free.begin, free.end)
    first = math.floor(time[0] + zero) if begin is None else round(begin + zero, 3)
    last = math.floor(time[-1] + zero) + 1 if end is None else round(end + zero, 3)
    return f"[{first:.12g}, {last:.12g}]"


def _read(source: str | Path, signals: Signals) -> Record | None:
    """The cleaned record; None where it cannot be used."""
    try:
        return cleaned(read_record(source, signals)).record
    except InputError:
        return None
