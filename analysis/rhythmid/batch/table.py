"""The table of a batch as CSV and as Parquet."""

import csv
import io
import os
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path

from rhythmid.errors import InputError
from rhythmid.output import write_text
from rhythmid.result import Row

NUMBERS = ("value", "std")  # columns that hold numbers; the others hold text


def write_csv(path: Path, rows: Sequence[Row]) -> None:
    """Write all rows or none; unknown values are empty."""
    text = io.StringIO()
    writer = csv.DictWriter(text, list(rows[0]), lineterminator="\n")
    writer.writeheader()
    writer.writerows(rows)
    write_text(path, text.getvalue())


def write_parquet(path: Path, rows: Sequence[Row]) -> bool:
    """Write all rows or none; unknown values are null. Returns False and writes nothing if pyarrow is not installed."""
    try:
        import pyarrow
        from pyarrow import parquet
    except ModuleNotFoundError:
        return False
    fields = [(name, pyarrow.float64() if name in NUMBERS else pyarrow.string()) for name in rows[0]]
    table = pyarrow.Table.from_pylist([dict(row) for row in rows], pyarrow.schema(fields))
    partial = path.with_name(f".{path.name}.partial")
    try:
        parquet.write_table(table, partial)
        os.replace(partial, path)
    except OSError as error:
        raise InputError(f"{path}: cannot be written: {error.strerror}") from None
    finally:
        with suppress(OSError):
            partial.unlink()
    return True
