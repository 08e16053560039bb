"""Rows in the brackets of a MATLAB matrix, as the controllers of laboratories write them: `[ 0  0.000  12;` to `];`."""

import re
from collections.abc import Iterable, Iterator

OPENS = re.compile(
    r"^(\s*)(?:[A-Za-z]\w*\s*=\s*)?\[(?=\s*[-+.\d][^\[\]]*;\s*$)"
)  # to a row that ends with `;`
ENDS = re.compile(r"\s*(?:;|\]\s*;?)\s*$")


def rows_of_matrix(lines: Iterable[str]) -> Iterator[str]:
    """The lines, without the brackets of a matrix and the semicolons at the ends of its rows."""
    within = False
    for line in lines:
        if not within and "[" in line and OPENS.match(line):
            within = True
            line = OPENS.sub(r"\1 ", line)
        if not within:
            yield line
            continue
        within = "]" not in line
        yield ENDS.sub("", line) + "\n"
