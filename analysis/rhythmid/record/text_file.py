"""Encoding and compression of text files."""

import gzip
from pathlib import Path
from typing import TextIO

from rhythmid.errors import InputError
from rhythmid.record.compression import largest

COMPRESSED = ".gz"
SAMPLE = 1 << 16  # bytes used to detect the encoding
BYTE_ORDER_MARKS = {b"\xff\xfe": "utf-16", b"\xfe\xff": "utf-16", b"\xef\xbb\xbf": "utf-8-sig"}


def opened(path: Path) -> TextIO:
    """A text file, possibly compressed, opened for reading. Raises InputError where it is larger than a table can be."""
    packed = path.suffix.lower() == COMPRESSED
    if packed:
        _check_size(path)
    encoding = _encoding(path, packed)
    if packed:
        return gzip.open(path, "rt", encoding=encoding, errors="replace")
    return path.open(encoding=encoding, errors="replace")


def _encoding(path: Path, packed: bool) -> str:
    """UTF-8 or UTF-16 by byte-order mark, else UTF-8 if the beginning is valid UTF-8, else the Windows encoding."""
    with gzip.open(path) if packed else path.open("rb") as file:
        start = file.read(SAMPLE)
    for mark, encoding in BYTE_ORDER_MARKS.items():
        if start.startswith(mark):
            return encoding
    try:
        start[: start.rfind(b"\n") + 1].decode()
    except UnicodeDecodeError:
        return "cp1252"
    return "utf-8"


def _check_size(path: Path) -> None:
    """Raise InputError where a compressed table is larger than a table can be."""
    most = largest(path.stat().st_size)
    size = 0
    with gzip.open(path) as file:
        while piece := file.read(SAMPLE):
            size += len(piece)
            if size > most:
                raise InputError(
                    f"{path}: holds more than {most} bytes in {path.stat().st_size}: such tables are not read"
                )
