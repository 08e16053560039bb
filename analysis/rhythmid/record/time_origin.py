"""Where the time of a record begins: where its clock does if that started with the run, else at the first sample.

What changes with the time of a run, such as an actuator that fades, begins there; a clock that has run for an hour before says nothing of it.
"""

from dataclasses import replace

from rhythmid.record.record import Record

RUN_CLOCK = 10.0  # seconds; a clock that reads less at the first sample started with the run
CALENDAR = (
    1e8  # seconds, three years: a clock that reads more counts from 1970, not from the start of a machine
)


def origin_of(first: float) -> float:
    """Origin [s] of the time of a record whose first sample has the time `first` [s]."""
    return 0.0 if 0.0 <= first < RUN_CLOCK else first


def counted_from(record: Record, origin: float) -> Record:
    """The record with its times counted from an origin [s]. A forcing that is known by formula has its phase in the time as it is,
    so that a record with one is left alone."""
    if origin == 0.0 or record.forcing_law is not None:
        return record
    moved = {role: replace(one, time=one.time - origin) for role, one in record.channels.items()}
    return replace(record, **moved)
