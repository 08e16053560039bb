"""LabVIEW measurement files (.lvm): text tables below headers with one key and value per line.

National Instruments, Specification for the LabVIEW Measurement File (.lvm), 2020.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

FIRST = "LabVIEW Measurement"  # start of the first line
END = "***End_of_Header***"
TIME, REMARK = "X_Value", "Comment"  # names of the columns before and after the channels


@dataclass(frozen=True)
class LvmHead:
    """Number of header lines, the units of the channels (empty where none are given), and the times by start and step.

    `step` is 0 where each row states its time, in a column before the channels.
    """

    lines: int
    units: tuple[str, ...] = ()
    start: float = 0.0
    step: float = 0.0

    def names(self, head: Sequence[str], count: int) -> list[str]:
        """The names of `count` columns, without the remark column where rows end before it, and the units of all."""
        kept = list(head[:-1] if len(head) == count + 1 and head[-1] in ("", REMARK) else head)
        if not kept or kept[0] not in ("", TIME):
            return kept
        kept[0] = f"{TIME} [s]"
        units = [*("" for _ in kept[:1]), *self.units, *("" for _ in kept)]
        return [f"{name} [{unit}]" if unit else name for name, unit in zip(kept, units, strict=False)]

    def times(self, count: int) -> NDArray[np.float64]:
        """Times (n,) [s] of rows without a time."""
        return self.start + self.step * np.arange(count, dtype=np.float64)


def lvm_head(lines: Sequence[str]) -> LvmHead | None:
    """The headers of a file that begins with these lines; None where it is no LabVIEW measurement file."""
    if not lines or not lines[0].lstrip("\ufeff").startswith(FIRST):
        return None
    ends = [place for place, line in enumerate(lines) if line.startswith(END)]
    said = {}
    for line in lines[: ends[-1] + 1 if ends else 0]:
        word, *rest = line.strip().split("\t")
        said[word] = [cell.strip() for cell in rest]
    own_times = said.get("X_Columns", ["One"])[:1] != ["No"]
    step, start = (0.0 if own_times else _first(said.get(word, [])) for word in ("Delta_X", "X0"))
    return LvmHead(ends[-1] + 1 if ends else 1, tuple(said.get("Y_Unit_Label", ())), start, step)


def _first(cells: Sequence[str]) -> float:
    """The first number, 0 where there is none."""
    try:
        return float(cells[0].replace(",", "."))
    except (IndexError, ValueError):
        return 0.0
