"""The head of a text table: finds the lines with names and units above the rows."""

from collections.abc import Sequence

from rhythmid.record.heading import bare_unit, is_unit

MOSTLY = 0.5  # share of a line's filled cells with known units above which it is a line of units
PURE = ("", "-", "1")  # units of dimensionless numbers
# the label of a line of units, as logged beside them
LABELS = frozenset("unit units einheit einheiten unite unites unité unités unidad unidades unità".split())
TYPES = frozenset(
    "double single float float32 float64 real int int8 int16 int32 int64 uint8 uint16 uint32 integer long number numeric bool boolean "
    "string str text char datetime timestamp duration".split()
)  # of a line that states how the columns are stored


def names_of(above: Sequence[Sequence[str]], count: int) -> list[str] | None:
    """Names of `count` columns from the cells of the lines above the first row, with units where a line holds them.

    The units may be below or above the names. None where there is no line above. If no line has as many cells as
    the rows, the last one is returned unchanged, so that a message can quote it.
    """
    if not above:
        return None
    fitting: list[Sequence[str]] = []
    for cells in reversed(above):
        if len(cells) != count:
            break
        if not is_types(cells):
            fitting.append(cells)
    if not fitting:
        return list(above[-1])
    last, *before = fitting
    if before and is_units(last) and len(set(before[0])) > 1:
        return with_units(_told_by(before[0], before[1:]), last)
    if before and is_units(before[0]) and not is_units(last):
        return with_units(_told_by(last, before[1:]), before[0])
    return _told_by(last, before)


def _told_by(names: Sequence[str], above: Sequence[Sequence[str]]) -> list[str]:
    """Names in which empty or duplicate ones are completed by the lines above, the nearest first: `Rotation.X`,
    `Position.X`."""
    found = list(names)
    for line in above:
        unclear = [not name or found.count(name) > 1 for name in found]
        found = [
            ".".join(part for part in (upper.strip(), name) if part) if open_ else name
            for name, upper, open_ in zip(found, line, unclear, strict=True)
        ]
    return found


def is_units(cells: Sequence[str]) -> bool:
    """Whether a line holds units: most cells do, or all are in brackets, or no cell is anything else, as below
    names without units. Cells that say "Unit" are the line's label."""
    cells = [cell for cell in cells if not _is_label(cell)] or cells
    filled = [cell for cell in cells if cell.strip()]
    if all(cell.strip()[0] in "[({" and cell.strip()[-1] in "])}" for cell in filled):
        return True
    return sum(is_unit(cell) for cell in filled) > MOSTLY * len(filled) or all(
        is_unit(cell) for cell in cells
    )


def is_types(cells: Sequence[str]) -> bool:
    """Whether a line states how the columns are stored."""
    return all(cell.strip().lower() in TYPES for cell in cells)


def with_units(names: Sequence[str], units: Sequence[str]) -> list[str]:
    """Names with their units in brackets, except for dimensionless ones."""
    pairs = zip(names, map(bare_unit, units), strict=True)
    return [name if unit in PURE or _is_label(unit) else f"{name} [{unit}]" for name, unit in pairs]


def _is_label(cell: str) -> bool:
    return bare_unit(cell).rstrip(":").lower() in LABELS
