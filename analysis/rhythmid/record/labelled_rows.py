"""Logs with a label for each number in every row: `Time: 5001 Position: 594 Current: 511`, as printed for a user."""

import re
from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rhythmid.record.heading import is_unit
from rhythmid.record.text_cells import content
from rhythmid.record.text_rows import SHOWN

# a label that begins with a letter, a colon or an equals sign, a number, and directly or separately after it the unit
PAIR = re.compile(
    r"[\s,;|]*(?P<label>[^\W\d][^:=,;|\t]*?)\s*[:=]\s*"
    r"(?P<number>[-+]?(?:\d+\.?\d*(?:[eE][-+]?\d+)?|\.\d+(?:[eE][-+]?\d+)?|nan|inf))(?P<glued>[^\s,;|\d:=]*)"
    r"(?:[ \t]+(?P<alone>[^\s,;|\d:=]+)(?=\s*[,;|]))?(?=[\s,;|]|$)",
    re.IGNORECASE,
)
SEPARATORS = " \t\r\n,;|"
MOSTLY = 0.5  # share of the first lines with the same labels above which they are rows of a table
LEAST_ROWS = 3  # least number of rows with the same labels: fewer may be the head of a table


@dataclass(frozen=True, eq=False)
class Labelled:
    """Columns by label, and messages about the lines that are not rows."""

    columns: dict[str, NDArray[np.float64]]
    notes: tuple[str, ...] = ()


def labels_of(begin: Sequence[str]) -> tuple[str, ...] | None:
    """The labels that most of these lines have, with the units after the numbers; None where most lines have none."""
    lines = [line for line in begin if content(line)]
    found = Counter(tuple(name for name, _ in pairs) for line in lines if (pairs := pairs_of(line)))
    labels, count = found.most_common(1)[0] if found else ((), 0)
    if count < LEAST_ROWS or count <= MOSTLY * len(lines) or len(set(labels)) < len(labels):
        return None
    return labels


def read_labelled(lines: Iterable[str], labels: Sequence[str]) -> Labelled:
    """The rows with these labels; other lines are skipped and reported."""
    rows: list[list[float]] = []
    first, passed = "", 0
    for number, line in enumerate(lines, start=1):
        if not content(line):
            continue
        pairs = pairs_of(line)
        if len(pairs) == len(labels) and all(name == label for (name, _), label in zip(pairs, labels)):
            rows.append([value for _, value in pairs])
            continue
        passed += 1
        text = line.strip()
        first = first or f"line {number} ({text if len(text) <= SHOWN else text[:SHOWN] + '…'})"
    columns = dict(zip(labels, np.array(rows).reshape(-1, len(labels)).T, strict=True))
    said = f"{passed} line{'s' * (passed > 1)} without {', '.join(labels)} passed over, the first {first}"
    return Labelled(columns, (said,) if passed else ())


def pairs_of(line: str) -> list[tuple[str, float]]:
    """Label, with its unit where given, and number of every pair in a line; empty where the line contains anything
    else."""
    found: list[tuple[str, float]] = []
    place, text = 0, line.rstrip()
    while match := PAIR.match(text, place):
        unit, label = _parted(match["label"]) if found else ("", match["label"])
        if found and unit:
            found[-1] = (_with_unit(found[-1][0], unit), found[-1][1])
        if (alone := match["alone"]) and not is_unit(alone):
            return []
        found.append((_with_unit(label, match["glued"] or alone or ""), float(match["number"])))
        place = match.end()
    tail = text[place:].strip(SEPARATORS)
    if not found or (tail and not is_unit(tail)):
        return []
    return [*found[:-1], (_with_unit(found[-1][0], tail), found[-1][1])] if tail else found


def _parted(label: str) -> tuple[str, str]:
    """The unit of the number before a label, and the label itself: for `deg Motor current` the unit is `deg`."""
    unit, _, rest = label.partition(" ")
    return (unit, rest.strip()) if rest.strip() and is_unit(unit) else ("", label)


def _with_unit(label: str, unit: str) -> str:
    return f"{label} [{unit}]" if unit and is_unit(unit) else label
