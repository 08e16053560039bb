"""Rows that end before the last columns of their heading, as of a logger that writes an event or a remark only where there is one,
and several words in the last column where there are several."""

from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

from rhythmid.record.text_cells import cells_of, content, is_number

SEPARATORS = ("\t", ";", ",")  # with any number of spaces between columns, an empty cell does not show


@dataclass(frozen=True)
class Optional:
    """A heading of `width` cells in line `head`, counted from 0, below which rows may lack the last ones.

    Words beyond the heading are of its last column.
    """

    separator: str
    head: int
    width: int

    def filled(self, lines: Iterable[str]) -> Iterator[str]:
        """The lines below the heading with as many cells as it has; a row of too many numbers is left as it is."""
        for number, line in enumerate(lines):
            if number <= self.head or not content(line):
                yield line
                continue
            plain = '"' not in line
            if plain and line.count(self.separator) + 1 == self.width:
                yield line
                continue
            cells = cells_of(line, self.separator)
            missing, beyond = self.width - len(cells), cells[self.width :]
            text = line.rstrip("\r\n")
            end = line[len(text) :]
            if missing > 0:
                yield text + self.separator * missing + end
            elif beyond and plain and not any(is_number(one, ".") for one in beyond):
                kept = text.split(self.separator)
                yield self.separator.join([*kept[: self.width - 1], " ".join(kept[self.width - 1 :])]) + end
            else:
                yield line


def optional_cells(lines: Sequence[str]) -> Optional | None:
    """The heading of a table that starts with these lines, where most of its rows lack the last cells and some have them.

    None where all rows have as many cells, and where none fills the heading: then a cell may be missing anywhere.
    """
    used = [(number, line) for number, line in enumerate(lines) if content(line)]
    for separator in SEPARATORS:
        split = [cells_of(line, separator) for _, line in used]
        rows = [len(cells) for cells in split if any(is_number(cell, ".") for cell in cells)]
        usual = Counter(rows).most_common(1)[0][0] if rows else 0
        for place, cells in enumerate(split):
            named = (
                all(cells) and len(set(cells)) == len(cells) and not any(is_number(one, ".") for one in cells)
            )
            below = {len(one) for one in split[place + 1 :]}
            if (
                named
                and 1 < usual < len(cells)
                and below
                and min(below) == usual
                and max(below) >= len(cells)
            ):
                return Optional(separator, used[place][0], len(cells))
    return None
