"""LabVIEW's measurement files (.lvm): text tables below headers whose lines are pairs of a word and what it says.

National Instruments, Specification for the LabVIEW Measurement File (.lvm), 2020.
"""

from collections.abc import Sequence
from dataclasses import dataclass

FIRST = "LabVIEW Measurement"  # the first line begins so
END = "***End_of_Header***"
UNITS = "Y_Unit_Label"


@dataclass(frozen=True)
class LvmHead:
    """How many lines its headers have, and the units of the columns but the first, empty where none are told."""

    lines: int
    units: tuple[str, ...] = ()


def lvm_head(lines: Sequence[str]) -> LvmHead | None:
    """The headers of a file that begins with these lines; None where it is no measurement file of LabVIEW."""
    if not lines or not lines[0].lstrip("\ufeff").startswith(FIRST):
        return None
    ends = [place for place, line in enumerate(lines) if line.startswith(END)]
    units = next((line for line in lines if line.startswith(UNITS)), "")
    return LvmHead(
        ends[-1] + 1 if ends else 1, tuple(cell.strip() for cell in units.rstrip("\r\n\t ").split("\t")[1:])
    )
