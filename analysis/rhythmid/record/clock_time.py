"""Dates, times of day and durations in tables, converted to seconds."""

import re
from collections.abc import Sequence
from datetime import UTC, date, datetime, time

import numpy as np
from numpy.typing import NDArray

from rhythmid.record.heading import heading_of

Array = NDArray[np.float64]
DAY = 86400.0  # s
MONTHS = ("jan", "feb", "mar", "apr", "may", "jun", "jul", "aug", "sep", "oct", "nov", "dec")
CENTURY = 2000  # century of a two-digit year
OF_DAY = r"(\d{1,2}):(\d{2}):(\d{2}(?:[.,]\d+)?)\s*([ap]\.?m\.?)?"
DATED = re.compile(
    rf"(\d{{1,4}})[./-](\d{{1,2}}|[a-z]{{3}})[a-z]*[./-](\d{{1,4}})[ t,]\s*{OF_DAY}", re.IGNORECASE
)
TIMED = re.compile(OF_DAY, re.IGNORECASE)
ELAPSED = re.compile(
    r"(\d+):(\d{2}[.,]\d+)"
)  # minutes and seconds; without a fraction they could be hours and minutes
LASTING = re.compile(r"([+-]?[\d.]+(?:e[+-]?\d+)?)\s*([a-zµ]+)", re.IGNORECASE)


def seconds(cells: Sequence[str]) -> Array | None:
    """Seconds (n,) of cells that are all in one form; None where a cell is in none.

    The forms are: date and time (ISO 8601 and national forms; seconds since 1970, UTC where no zone is given), time
    of day (since the first day's midnight), minutes and seconds, and a duration with its unit. A new day starts
    where a time of day goes back by more than half a day. Where day and month could be exchanged, the order that
    gives the shorter record is taken.
    """
    for read in (_since_1970, _dated, _since_midnight, _elapsed, _lasting):
        try:
            found = read(cells)
        except ValueError:
            continue
        return found
    return None


def _since_1970(cells: Sequence[str]) -> Array:
    moments = (datetime.fromisoformat(cell) for cell in cells)
    return np.array([(one if one.tzinfo else one.replace(tzinfo=UTC)).timestamp() for one in moments])


def _dated(cells: Sequence[str]) -> Array:
    """Seconds (n,) of forms such as 05.01.2024 12:00:00,5, 1/5/2024 12:00:00 PM, 05-Jan-2024 12:00:00 and
    2024/01/05 12:00:00."""
    parts = [_match(DATED, cell) for cell in cells]
    of_day = np.array([_of_day(*part[3:]) for part in parts])
    days: list[Array] = []
    for order in ((0, 1, 2), (2, 1, 0), (2, 0, 1)):  # positions of year, month and day
        try:
            days.append(DAY * np.array([_days(*(part[place] for place in order)) for part in parts]))
        except ValueError:
            continue
    if not days:
        raise ValueError
    return min((one + of_day for one in days), key=lambda one: float(np.ptp(one)))


def _days(year: str, month: str, day: str) -> int:
    """Days since 1970. Raises ValueError for a day that does not exist."""
    if len(year) not in (2, 4) or len(day) > 2:
        raise ValueError
    number = MONTHS.index(month.lower()) + 1 if month.isalpha() else int(month)
    full = int(year) + (CENTURY if len(year) == 2 else 0)
    return date(full, number, int(day)).toordinal() - date(1970, 1, 1).toordinal()


def _since_midnight(cells: Sequence[str]) -> Array:
    found = np.array([_time_of_day(cell) for cell in cells])
    found[1:] += DAY * np.cumsum(np.diff(found) < -DAY / 2)
    return found


def _time_of_day(cell: str) -> float:
    if TIMED.fullmatch(cell):
        return _of_day(*_match(TIMED, cell))
    read = time.fromisoformat(cell)
    return 3600.0 * read.hour + 60.0 * read.minute + read.second + 1e-6 * read.microsecond


def _of_day(hour: str, minute: str, second: str, half: str | None) -> float:
    """Seconds since midnight."""
    hours, minutes, rest = int(hour), int(minute), float(second.replace(",", "."))
    if half:
        hours = hours % 12 + (12 if half[0] in "pP" else 0)
    if hours > 23 or minutes > 59 or rest >= 61.0:
        raise ValueError
    return 3600.0 * hours + 60.0 * minutes + rest


def _elapsed(cells: Sequence[str]) -> Array:
    parts = (_match(ELAPSED, cell) for cell in cells)
    return np.array([60.0 * int(minutes) + float(rest.replace(",", ".")) for minutes, rest in parts])


def _lasting(cells: Sequence[str]) -> Array:
    """Seconds (n,) of durations with a unit, as MATLAB writes them: 0.01 sec."""
    parts = [_match(LASTING, cell) for cell in cells]
    units = {unit: heading_of(f"t [{unit}]") for _, unit in parts}
    if any(one.unit != "s" for one in units.values()):
        raise ValueError
    return np.array([float(value) * units[unit].scale for value, unit in parts])


def _match(form: re.Pattern[str], cell: str) -> tuple[str, ...]:
    found = form.fullmatch(cell.strip())
    if found is None:
        raise ValueError
    return found.groups()
