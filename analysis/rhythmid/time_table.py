"""A function of time in a CSV file: two columns, seconds and a value; a header line and # comments may be there."""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from rhythmid.errors import InputError


def read_time_table(path: str | Path, meaning: str) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Times [s], increasing, and values; shapes (n,), (n,), n >= 1. `meaning` names the second column in messages.

    Raises InputError, naming the line, when the file is not such a table.
    """
    try:
        lines = Path(path).read_text(encoding="utf-8").splitlines()
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(
            f"{path}: cannot be read: {getattr(error, 'strerror', None) or 'is not text'}"
        ) from None
    rows: list[tuple[float, ...]] = []
    header = False
    for number, line in enumerate(lines, start=1):
        cells = [cell.strip() for cell in line.partition("#")[0].split(",")]
        if cells == [""]:
            continue
        try:
            row = tuple(map(float, cells))
        except ValueError:
            if not rows and not header:
                header = True
                continue
            row = ()
        if len(row) != 2 or not np.isfinite(row).all():
            raise InputError(f"{path}:{number}: two finite numbers are expected: time [s], {meaning}")
        if rows and row[0] <= rows[-1][0]:
            raise InputError(f"{path}:{number}: the times must increase")
        rows.append(row)
    if not rows:
        raise InputError(f"{path}: holds no numbers; two columns are expected: time [s], {meaning}")
    table = np.array(rows)
    return table[:, 0], table[:, 1]
