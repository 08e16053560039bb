"""Cells in quotes that a program has broken into several lines, as NumPy does with what it prints of more than six numbers."""

import re
from collections.abc import Iterable, Iterator

OPENS = re.compile(r"""(?:^|[\s,;])"(?:\w+\()?[\[(][^"]*$""")  # a list that does not end in its line
MOST_LINES_OF_CELL = 64  # lines of one cell: more than a list of joints takes


def unbroken(lines: Iterable[str]) -> Iterator[str]:
    """The lines, each with what continues it; empty lines stand for those that do, so that all others keep their numbers."""
    parts: list[str] = []
    for line in lines:
        opens = bool(OPENS.search(line.rstrip())) if '"' in line else bool(parts)
        parts.append(line)
        if opens and len(parts) < MOST_LINES_OF_CELL:
            continue
        if (
            opens or len(parts) == 1
        ):  # a quotation mark that stands for something else, or a line that is whole
            yield from parts
        else:
            yield " ".join(part.strip(" \r\n") for part in parts[:-1]) + " " + parts[-1].lstrip(" ")
            yield from ["\n"] * (len(parts) - 1)
        parts = []
    yield from parts
