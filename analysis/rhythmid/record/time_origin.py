"""Origin of a record's time: the zero of its clock if the clock started with the run, else the first sample.

Effects that depend on the time of a run, such as an actuator that fades, start there. A clock that was running for
an hour before does not show that time.
"""

from dataclasses import replace

from rhythmid.record.record import Record

RUN_CLOCK = 10.0  # [s]; a clock with a smaller first time started with the run
# [s], three years: a clock with a larger time counts from 1970, not from the start of a machine
CALENDAR = 1e8


def origin_of(first: float) -> float:
    """Origin [s] of the time of a record whose first sample has the time `first` [s]."""
    return 0.0 if 0.0 <= first < RUN_CLOCK else first


def counted_from(record: Record, origin: float) -> Record:
    """The record with its times relative to an origin [s]. The phase of a forcing formula refers to the unshifted
    time, so a record with such a formula is unchanged."""
    if origin == 0.0 or record.forcing_law is not None:
        return record
    moved = {role: replace(one, time=one.time - origin) for role, one in record.channels.items()}
    return replace(record, use_zero=origin, **moved)
