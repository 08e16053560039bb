"""Selects the column of a table that holds the times, and its unit in seconds."""

import re
from collections.abc import Sequence
from datetime import UTC, datetime
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from rhythmid.errors import InputError
from rhythmid.record.clock_time import DAY
from rhythmid.record.heading import heading_of
from rhythmid.record.record import FEWEST_COMMON_SAMPLES
from rhythmid.record.signals import Clock
from rhythmid.record.timing import SHORTEST_RUN

Array = NDArray[np.float64]
TIME = re.compile(
    r"(?:elapsed_?|time_?|wall_?|ros_?)*(?:t|time|timestamp|stamp|seconds|secs?|clock|tiempo|tempo|temps|zeit)",
    re.IGNORECASE,
)
IN_BRACKETS = re.compile(
    r"(?<=\w)\s*(?:\([^()]*\)|\[[^\[\]]*[^\[\]\d][^\[\]]*\])\s*$"
)  # a unit; [3] is an array index
KIND_OF_TIME = re.compile(r".*_(?:time|timestamp|stamp|clock)", re.IGNORECASE)  # pi_time, cpu_time
COUNTER = re.compile(
    r"|index|idx|i|n|k|id|no|nr|frame|sample|step|row|count|counter|seq|unnamed: 0", re.IGNORECASE
)
USUAL_STEP_DEVIATION = 0.5  # share of the median step of an unnamed column within which a step is usual
USUAL = 0.95  # least share of usual steps for a time column; the other steps are gaps of any length
MOST_NAMED = 12  # largest number of columns in a message
FORWARD = 0.99  # least share of forward steps of a time
# [s] largest plausible sample period: a time without a unit and with longer steps is in ms, µs or ns
LONGEST_STEP = 0.5
# days since 1900 in the years 2000 to 2100: values in this range with steps of at most a second are a spreadsheet's time
SERIAL_DAYS = (36526.0, 73051.0)
DATED = (946684800.0, 4102444800.0)  # seconds since 1970 of the same years
UNITS = ((1.0, "s"), (1e-3, "ms"), (1e-6, "us"), (1e-9, "ns"))  # in which times are written
NANOSECOND = 1e-9  # [s] smallest unit in which times are written
MOSTLY_FORWARD = 0.9  # the same for a time that restarts with each of several recordings


def is_time(name: str, value: Array) -> bool:
    """Whether a column is named as a time, or a kind of time, and increases."""
    return is_called_time(name) and _forward(value)


def is_further_time(name: str, value: Array) -> bool:
    """Whether a column beside the clock is a time, too; not one in seconds that mostly stands still, such as a
    pulse width."""
    held = TIME.fullmatch(_called(name)) is None and KIND_OF_TIME.fullmatch(_called(name)) is None
    return is_time(name, value) and not (held and _is_coarse(value))


def is_called_time(name: str) -> bool:
    """Whether a column is named as a time, or a kind of time."""
    return _is_plain_time(name) or KIND_OF_TIME.fullmatch(_called(name)) is not None


def _is_plain_time(name: str) -> bool:
    """Whether a column's name means time and nothing else, or its unit is a time unit."""
    return TIME.fullmatch(_called(name)) is not None or heading_of(name).unit == "s"


def _is_coarse(value: Array) -> bool:
    """Whether a time is equal in most consecutive rows, as whole seconds are."""
    return float(np.mean(np.diff(value) == 0.0)) > 0.5 if len(value) > 1 else False


def _called(name: str) -> str:
    """The last part of a name, without brackets and their content."""
    return re.split(r"[./]", IN_BRACKETS.sub("", heading_of(name).name))[-1].replace(" ", "_")


def _forward(value: Array) -> bool:
    step = np.diff(value)
    if not len(step) or not np.isfinite(value).all():
        return False
    return bool(value[-1] > value[0]) and float(np.mean(step >= 0.0)) >= FORWARD


def _begins_anew(value: Array) -> bool:
    """Whether a time increases except for some steps, as in concatenated recordings."""
    step = np.diff(value)
    return bool(
        np.isfinite(value).all() and (step < 0.0).any() and float(np.mean(step >= 0.0)) >= MOSTLY_FORWARD
    )


def is_even(value: Array) -> bool:
    """Whether a column increases by steps of mostly one size, as a time with gaps does."""
    if not _forward(value):
        return False
    step = np.diff(value)
    usual = float(np.median(step))
    in_any_unit = 0.0 < usual <= LONGEST_STEP / NANOSECOND
    return in_any_unit and float(np.mean(np.abs(step - usual) <= USUAL_STEP_DEVIATION * usual)) >= USUAL


def row_of_restart(value: Array) -> int | None:
    """Index of the first row in which a time begins anew, at about its first value, after a run of some length; None
    where there is none."""
    step = np.diff(value)
    usual = float(np.median(step)) if len(step) else 0.0
    near = value[1:] <= value[0] + SHORTEST_RUN * usual
    back = 1 + np.flatnonzero((step < 0.0) & near)
    return int(back[0]) if len(back) and back[0] >= SHORTEST_RUN else None


def restarting(columns: Sequence[tuple[str, Array]]) -> str | None:
    """Name of the column that holds the time by its name or its steps and begins anew; None where none does."""
    return next(
        (
            name
            for name, value in columns
            if (is_called_time(name) or _is_untold_time(name, value))
            and np.isfinite(value).all()
            and row_of_restart(value) is not None
        ),
        None,
    )


def _refuse_restart(path: Path, name: str, value: Array) -> None:
    """Raise InputError where the column that holds the time begins anew."""
    if (row := row_of_restart(value)) is not None:
        raise InputError(
            f"{path}: the time, {name!r}, begins anew in row {row + 1}, so that several recordings are in one table; take them apart with  "
            f"rhythmid split {path} --out runs"
        )


def has_time(columns: Sequence[tuple[str, Array]]) -> bool:
    """Whether one of the numeric columns is taken as the time."""
    return any(is_time(name, value) for name, value in columns) or any(
        _is_untold_time(*one) for one in columns
    )


def _is_untold_time(name: str, value: Array) -> bool:
    """Whether a column that is not named as a time is one by its steps; a column of row numbers only if it has no
    name."""
    if heading_of(name).unit or not is_even(value):
        return False
    step = np.diff(value)
    counts = COUNTER.fullmatch(name) is not None and bool((step == np.round(step)).all())
    return not counts and (name.isdigit() or not bool((step == 1.0).all()))


def table_clock(
    path: Path, columns: list[tuple[str, Array]], unequal: list[tuple[str, Array]]
) -> tuple[Clock, str]:
    """The column that holds the time. Raises InputError where there is none among those of equal length; `unequal`
    are the others."""
    for name, value in sorted(
        columns, key=lambda column: (not _is_plain_time(column[0]), _is_coarse(column[1]))
    ):
        if is_time(name, value):
            _refuse_restart(path, name, value)
            return named_clock(name, value)
    for name, value in columns:
        if _is_untold_time(name, value):
            _refuse_restart(path, name, value)
            scale, why = _guessed_scale(value)
            return Clock(
                "column", column=name, scale=scale
            ), f"the first column that goes forward by steps of one size; {why}"
    if (alone := _rises_alone(columns)) is not None:
        scale, why = _guessed_scale(dict(columns)[alone])
        return Clock(
            "column", column=alone, scale=scale
        ), f"the only column that increases in every row; {why}"
    names = ", ".join(name for name, _ in columns[:MOST_NAMED])
    if len(columns) > MOST_NAMED:
        names += f" and {len(columns) - MOST_NAMED} more"
    others = ", ".join(f"{name} has {len(value)} rows" for name, value in unequal)
    if anew := [name for name, value in columns if _is_plain_time(name) and _begins_anew(value)]:
        row = 2 + int(np.argmax(np.diff(dict(columns)[anew[0]]) < 0.0))
        raise InputError(
            f"{path}: {anew[0]!r} begins anew or goes back, first in row {row}; take the recordings apart with  rhythmid split {path} --out runs"
        )
    if len(columns[0][1]) < FEWEST_COMMON_SAMPLES:
        raise InputError(
            f"{path}: holds no recording: its columns have {len(columns[0][1])} values ({names})"
        )
    for name, value in columns:
        if _is_plain_time(name) and _forward(value[np.isfinite(value)]):
            row = int(np.argmin(np.isfinite(value))) + 1
            raise InputError(f"{path}: the time is missing in row {row} ({name}); delete rows without a time")
    why = f"; of another length than their {len(columns[0][1])} rows: {others}" if others else ""
    raise InputError(
        f"{path}: no column goes forward like a time ({names}){why}; give the rows' rate with --rate HZ"
    )


def _rises_alone(columns: Sequence[tuple[str, Array]]) -> str | None:
    """Name of the only column that increases in every row of a table without names; None where there is none, or more
    than one. A loop without a fixed period, and a recorder of events, write times by uneven steps."""
    rising = [name for name, value in columns if bool((np.diff(value) > 0.0).all())]
    unnamed = len(columns) > 1 and all(name.isdigit() for name, _ in columns)
    return rising[0] if unnamed and len(rising) == 1 and len(columns[0][1]) >= FEWEST_COMMON_SAMPLES else None


def named_clock(name: str, value: Array) -> tuple[Clock, str]:
    """The clock from a column that is named as a time and increases, and the reason for the choice."""
    heading = heading_of(name)
    scale, why = heading.scale, f"its heading says {heading.written}" if heading.unit else ""
    if not why:
        scale, why = _guessed_scale(value)
    elif not _is_dated(value, scale):
        for other, unit in UNITS:
            if _is_dated(value, other):
                why = f"its heading says {heading.written}, but as {unit} it is a date ({_date(value, other)}), so that {unit} is taken"
                scale = other
    return Clock("column", column=name, scale=scale), f"called a time, and goes forward; {why}"


def _is_dated(value: Array, scale: float) -> bool:
    """Whether a time whose unit is `scale` s counts from 1970 to our years, by steps that a recorder may make."""
    step = float(np.median(np.diff(value))) * scale
    return DATED[0] <= float(value[0]) * scale <= DATED[1] and 0.0 < step < LONGEST_STEP


def _date(value: Array, scale: float) -> str:
    """The day of the first time."""
    return str(datetime.fromtimestamp(float(value[0]) * scale, UTC).date())


def _guessed_scale(value: Array) -> tuple[float, str]:
    """Seconds per unit of a time without a stated unit: that in which it is a date, else by the size of its steps. Messages
    that come in bursts are closer together than a unit tells."""
    step = float(np.median(np.diff(value)))
    for scale, unit in UNITS:
        if _is_dated(value, scale):
            return scale, f"as {unit} it is a date ({_date(value, scale)})"
    if SERIAL_DAYS[0] <= value[0] <= SERIAL_DAYS[1] and step <= 1.2 / DAY:
        return (
            DAY,
            f"steps of {step:.4g} from {value[0]:.6g} are taken to be days, as a spreadsheet counts them",
        )
    for scale, unit in UNITS[:-1]:
        if step * scale < LONGEST_STEP:
            return scale, f"steps of {step:.4g} are taken to be {unit}"
    return NANOSECOND, f"steps of {step:.4g} are taken to be ns"
