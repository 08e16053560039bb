"""Quoted cells that a program has broken into several lines, as NumPy does when it prints more than six numbers."""

import re
from collections.abc import Iterable, Iterator

OPENS = re.compile(r"""(?:^|[\s,;])"(?:\w+\()?[\[(][^"]*$""")  # a list that does not end on its line
MOST_LINES_OF_CELL = 64  # largest number of lines of one cell: more than a list of joints needs


def unbroken(lines: Iterable[str]) -> Iterator[str]:
    """The lines, joined with their continuation lines. Empty lines replace the continuations, so that line numbers
    stay valid."""
    parts: list[str] = []
    for line in lines:
        opens = bool(OPENS.search(line.rstrip())) if '"' in line else bool(parts)
        parts.append(line)
        if opens and len(parts) < MOST_LINES_OF_CELL:
            continue
        if opens or len(parts) == 1:  # a quotation mark with another meaning, or a complete line
            yield from parts
        else:
            yield " ".join(part.strip(" \r\n") for part in parts[:-1]) + " " + parts[-1].lstrip(" ")
            yield from ["\n"] * (len(parts) - 1)
        parts = []
    yield from parts
