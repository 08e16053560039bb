"""Hypotheses by their evidence: how much worse than the best each predicts held-out data, with its standard error."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from html import escape

from rhythmid.report.chart import WIDTH, opening
from rhythmid.report.quantity import number
from rhythmid.report.row_chart import row_heights, row_label, row_label_width

ROW = 34.0
NUMBERS = 88.0  # width of the column with probabilities
CAP = 4.0  # half the height of an error bar's ends
TICKS = (0.0, 1.0, 10.0, 100.0, 1e3, 1e4, 1e5, 1e6)


@dataclass(frozen=True)
class Evidence:
    """A hypothesis: `worse` is the difference of its prediction from the best, `error` the standard error of the difference; `text` is its weight,
    `style` a class of the style sheet, `hint` what is shown under the pointer."""

    label: str
    worse: float
    error: float
    text: str
    style: str = "measured"
    marked: bool = False
    hint: str = ""


def draw_evidence(alt: str, rows: Sequence[Evidence], level: float, level_label: str, heading: str) -> str:
    """One row each: a dot with its error bar on an axis that is linear near zero and logarithmic beyond, and its weight.

    `level` is marked by a line through all rows.
    """
    left = row_label_width([row.label for row in rows])
    right = WIDTH - NUMBERS
    most = _compressed(max([*(row.worse + row.error for row in rows), 2.0 * level]))

    def place(value: float) -> float:
        return left + 4.0 + _compressed(max(value, 0.0)) / most * (right - left - 16.0)

    top = 30.0
    heights = row_heights([row.label for row in rows], ROW)
    bottom = top + sum(heights)
    parts = [opening(WIDTH, bottom + 38.0, alt)]
    for tick in _ticks(most, right - left):
        at = place(tick)
        parts.append(f'<line class="grid" x1="{at:.1f}" x2="{at:.1f}" y1="{top:.1f}" y2="{bottom:.1f}"/>')
        parts.append(
            f'<text x="{at:.1f}" y="{bottom + 15:.1f}" text-anchor="middle">{number(tick, 3)}</text>'
        )
    parts.append(
        f'<text class="label" x="{0.5 * WIDTH:.1f}" y="{bottom + 32:.1f}" text-anchor="middle">predicts worse by (difference of log density)</text>'
    )
    at = place(level)
    parts.append(f'<line class="level" x1="{at:.1f}" x2="{at:.1f}" y1="{top - 4:.1f}" y2="{bottom:.1f}"/>')
    parts.append(f'<text class="note" x="{at:.1f}" y="{top - 8:.1f}">{escape(level_label)}</text>')
    parts.append(
        f'<text class="note" x="{WIDTH - 2:.1f}" y="{top - 8:.1f}" text-anchor="end">{escape(heading)}</text>'
    )
    below = top
    for row, tall in zip(rows, heights, strict=True):
        parts += _row(row, below + 0.5 * tall, left, place)
        below += tall
    return "".join([*parts, "</svg>"])


def _row(row: Evidence, y: float, left: float, place: Callable[[float], float]) -> list[str]:
    low, high, at = place(row.worse - row.error), place(row.worse + row.error), place(row.worse)
    strong = " strong" if row.marked else ""
    return [
        f"<g><title>{escape(row.hint or row.label)}</title>",
        row_label(row.label, left - 8.0, y, strong),
        f'<line class="whisker {row.style}" x1="{low:.1f}" x2="{high:.1f}" y1="{y:.1f}" y2="{y:.1f}"/>',
        *(
            f'<line class="whisker {row.style}" x1="{x:.1f}" x2="{x:.1f}" y1="{y - CAP:.1f}" y2="{y + CAP:.1f}"/>'
            for x in (low, high)
            if row.error > 0.0
        ),
        f'<circle class="dot {row.style}" cx="{at:.1f}" cy="{y:.1f}" r="5"/>',
        f'<text class="{strong.strip()}" x="{WIDTH - 2:.1f}" y="{y + 4:.1f}" text-anchor="end">{escape(row.text)}</text></g>',
    ]


def _compressed(value: float) -> float:
    return math.log10(1.0 + value)


def _ticks(most: float, width: float) -> list[float]:
    """Ticks up to the end of the axis, with room for their numbers."""
    inside = [tick for tick in TICKS if _compressed(tick) <= most]
    stride = max(1, math.ceil(len(inside) * 44.0 / width))
    return inside[::stride]
