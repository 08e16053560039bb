"""Correlation of the errors of parameters, as a coloured matrix."""

from collections.abc import Sequence
from dataclasses import dataclass
from html import escape

import numpy as np
from numpy.typing import NDArray

from rhythmid.report.blocks import Drawing
from rhythmid.report.chart import WIDTH, opening
from rhythmid.report.quantity import NONE, number, pretty_name
from rhythmid.report.row_chart import row_label, row_label_height, row_label_width
from rhythmid.report.state_map import SHADES, shade_class

Array = NDArray[np.float64]
HIGH_ROW = 34.0  # largest height of a row; the smallest is that of its name
WIDE_ENOUGH = 34.0  # width of a cell from which a number fits into it
STRONG = 0.9  # correlation above which two parameters are hardly separable


@dataclass(frozen=True, eq=False)
class Correlation:
    """Correlation coefficients of estimates: `names` of the parameters, p of them, `matrix` float64[p, p], NaN where one is not
    determined."""

    names: tuple[str, ...]
    matrix: Array


def correlation_figure(found: Correlation) -> Drawing:
    """The matrix: colours below the diagonal, numbers above it where there is room."""
    return Drawing(
        "Correlation of the parameters",
        _draw(found),
        f"How the errors of two estimates go together: 1 and −1 mean that the records determine only one combination of the two. "
        f"Columns are numbered like rows. {_strongest(found)}",
    )


def _strongest(found: Correlation) -> str:
    rows, columns = np.tril_indices(len(found.names), -1)
    sizes = np.nan_to_num(np.abs(found.matrix[rows, columns]))
    strong = [k for k in np.argsort(-sizes, kind="stable")[:3] if sizes[k] > STRONG]
    if not strong:
        return f"No two are correlated by more than {number(STRONG)}."
    pairs = (
        f"{pretty_name(found.names[columns[k]])} with {pretty_name(found.names[rows[k]])} "
        f"({_told(float(found.matrix[rows[k], columns[k]]))})"
        for k in strong
    )
    return f"Hard to tell apart: {'; '.join(pairs)}."


def _told(value: float) -> str:
    """Two decimals; a value that is not exactly 1 is never printed as 1."""
    if not np.isfinite(value):
        return NONE
    text = f"{abs(value):.2f}"
    if text == "1.00" and abs(value) < 1.0:
        text = f"{np.floor(1e4 * abs(value)) / 1e4:.4f}".rstrip("0") if abs(value) < 0.9999 else ">0.999"
    return ("−" if value < 0.0 and float(f"{value:.2f}") != 0.0 else "") + text


def _draw(found: Correlation) -> str:
    count = len(found.names)
    names = [f"{pretty_name(name)}  {k}" for k, name in enumerate(found.names, start=1)]
    left = row_label_width(names)
    wide = (WIDTH - left - 4.0) / count
    tall = float(np.clip(wide, max(map(row_label_height, names)), HIGH_ROW))
    wide = min(wide, 2.0 * tall)
    top = 20.0
    bottom = top + tall * count
    alt = "Correlation of the estimates: " + "; ".join(
        f"{pretty_name(found.names[j])} with {pretty_name(found.names[i])} {_told(float(found.matrix[i, j]))}"
        for i in range(count)
        for j in range(i)
    )
    parts = [opening(WIDTH, bottom + 30.0, alt)]
    for row, name in enumerate(names):
        y = top + tall * row
        parts.append(row_label(name, left - 8.0, y + 0.5 * tall))
        at = left + wide * (row + 0.5)
        parts.append(f'<text x="{at:.1f}" y="{top - 6:.1f}" text-anchor="middle">{row + 1}</text>')
        for column in range(count):
            x, value = left + wide * column, float(found.matrix[row, column])
            hint = f"{names[row]} and {names[column]}: {_told(value)}"
            level = round(value * SHADES) if np.isfinite(value) else 0
            if column > row and wide >= WIDE_ENOUGH:
                parts.append(
                    f'<text x="{x + 0.5 * wide:.1f}" y="{y + 0.5 * tall + 4:.1f}" text-anchor="middle">{_told(value)}</text>'
                )
                continue
            fill = shade_class(level) if row != column else "panel"
            parts.append(
                f'<rect class="cell {fill} edge" x="{x:.1f}" y="{y:.1f}" width="{wide:.1f}" height="{tall:.1f}">'
                f"<title>{escape(hint)}</title></rect>"
            )
    parts += _scale(left, bottom + 12.0)
    return "".join([*parts, "</svg>"])


def _scale(left: float, y: float) -> Sequence[str]:
    step = min(16.0, (WIDTH - left - 60.0) / (2 * SHADES + 1))
    cells = [
        f'<rect class="cell {shade_class(level)} edge" x="{left + 24 + (level + SHADES) * step:.1f}" y="{y:.1f}" width="{step:.1f}" height="12"/>'
        for level in range(-SHADES, SHADES + 1)
    ]
    end = left + 30.0 + (2 * SHADES + 1) * step
    return [
        f'<text x="{left + 19:.1f}" y="{y + 10:.1f}" text-anchor="end">−1</text>',
        *cells,
        f'<text x="{end:.1f}" y="{y + 10:.1f}">1</text>',
    ]
