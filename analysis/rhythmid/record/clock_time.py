"""Dates and times of day, as programs write them into a table, in seconds."""

from collections.abc import Sequence
from datetime import UTC, datetime, time

import numpy as np
from numpy.typing import NDArray

DAY = 86400.0  # s


def seconds(cells: Sequence[str]) -> NDArray[np.float64] | None:
    """Seconds (n,) of cells that all hold a date and time (ISO 8601; since 1970, without a zone in UTC) or all a time of day
    (since the first day's midnight). None where one holds neither.

    A day ends where a time of day goes back by more than half a day.
    """
    for read in (_since_1970, _since_midnight):
        try:
            found = np.array([read(cell) for cell in cells])
        except ValueError:
            continue
        if read is _since_midnight:
            found[1:] += DAY * np.cumsum(np.diff(found) < -DAY / 2)
        return found
    return None


def _since_1970(cell: str) -> float:
    moment = datetime.fromisoformat(cell)
    return (moment if moment.tzinfo else moment.replace(tzinfo=UTC)).timestamp()


def _since_midnight(cell: str) -> float:
    of_day = time.fromisoformat(cell)
    return 3600.0 * of_day.hour + 60.0 * of_day.minute + of_day.second + 1e-6 * of_day.microsecond
