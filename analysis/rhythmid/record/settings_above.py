"""Settings above a text table: a line of numbers with another number of cells than the rows, such as `90, 1000, 5`, and
the line of their names. Neither names the columns."""

from collections.abc import Sequence

from rhythmid.record.text_cells import cells_of, is_number, number_of


def without_settings(
    lines: Sequence[str], width: int, separators: Sequence[str | None]
) -> tuple[int, dict[str, float]]:
    """How many of the lines above rows of `width` cells are left before settings and their names, and the named settings.

    The numbers may have another separator than the rows. The rest of a lost row is removed alike.
    """
    kept, found = list(lines), dict[str, float]()
    while kept:
        settings = _numbers(kept[-1], width, separators)
        if settings is None:
            break
        kept.pop()
        separator, values = settings
        names = cells_of(kept[-1], separator) if kept else []
        if len(names) != len(values):
            continue
        if not any(is_number(name, ".") for name in names) and (len(values) > 1 or width == 1):
            found |= {name: value for name, value in zip(names, values, strict=True) if name not in found}
            kept.pop()
    return len(kept), found


def _numbers(
    line: str, width: int, separators: Sequence[str | None]
) -> tuple[str | None, list[float]] | None:
    """The numbers of a line that holds nothing else, and their separator; None where it is a row of the table, or
    holds a word."""
    split = [(separator, [cell for cell in cells_of(line, separator) if cell]) for separator in separators]
    told = [(one, cells) for one, cells in split if cells and all(is_number(cell, ".") for cell in cells)]
    if not told or any(len(cells) == width for _, cells in told):
        return None
    separator, cells = max(told, key=lambda pair: len(pair[1]))
    return separator, [value for cell in cells if (value := number_of(cell, ".")) is not None]
