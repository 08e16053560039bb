"""Charts of named rows: bars, or two dots a row joined by a line."""

from collections.abc import Sequence
from dataclasses import dataclass
from html import escape
from textwrap import wrap

import numpy as np

from rhythmid.report.chart import WIDTH, Axis, extent, opening
from rhythmid.report.quantity import number

ROW = 28.0
WRAP = 22  # letters in a line of a row's name
LETTER = 7.9  # [px] mean width of a bold letter at the size of a chart's text; names of marked rows are bold


@dataclass(frozen=True)
class Bar:
    """A row with one value; `style` is a class of the style sheet, `marked` sets it off."""

    label: str
    value: float
    text: str
    style: str = "measured"
    marked: bool = False


@dataclass(frozen=True)
class Change:
    """A row with a value before and one after; `floor` is the least that could be reached."""

    label: str
    before: float
    after: float | None = None
    floor: float | None = None


def row_label_width(labels: Sequence[str]) -> float:
    """Room that the rows' names take."""
    lines = [line for label in labels for line in wrap(label, WRAP)]
    return max((len(line) for line in lines), default=4) * LETTER + 14.0


def row_label_height(text: str) -> float:
    """Height that a row's name takes, with the air above and below it."""
    return 5.0 + 13.0 * len(wrap(text, WRAP))


def row_heights(labels: Sequence[str], least: float) -> list[float]:
    """Height of each row, so that no name touches the next."""
    return [max(least, row_label_height(label)) for label in labels]


def row_label(text: str, x: float, middle: float, strong: str = "") -> str:
    """A row's name, right-aligned at x, on as many lines as it needs."""
    lines = wrap(text, WRAP) or [""]
    first = middle + 4.0 - 6.5 * (len(lines) - 1)
    spans = "".join(
        f'<tspan x="{x:.1f}" y="{first + 13 * i:.1f}">{escape(line)}</tspan>' for i, line in enumerate(lines)
    )
    return f'<text class="label{strong}" text-anchor="end">{spans}</text>'


def draw_bars(
    alt: str, bars: Sequence[Bar], level: float | None = None, level_label: str = "", full: float = 0.0
) -> str:
    """Horizontal bars from zero, each with its number at the end; `level` is marked by a line through all. `full` is the least
    that the width stands for."""
    left = row_label_width([bar.label for bar in bars])
    most = max([bar.value for bar in bars] + [level or 0.0, full, 1e-300])
    axis = Axis(0.0, most, left, WIDTH - 62.0)
    top = 18.0 if level is not None else 4.0
    heights = row_heights([bar.label for bar in bars], ROW)
    height = top + sum(heights) + 4.0
    parts = [opening(WIDTH, height, alt)]
    below = top
    for bar, tall in zip(bars, heights, strict=True):
        y = below + 0.5 * (tall - ROW)
        below += tall
        end = float(axis(max(bar.value, 0.0)))
        strong = " strong" if bar.marked else ""
        parts.append(row_label(bar.label, left - 8.0, y + 12.5, strong))
        parts.append(
            f'<rect class="bar {bar.style}" x="{left:.1f}" y="{y + 4:.1f}" width="{max(end - left, 1.0):.1f}" height="{ROW - 9:.1f}" rx="2"/>'
        )
        parts.append(
            f'<text class="{strong.strip()}" x="{end + 5:.1f}" y="{y + 17:.1f}">{escape(bar.text)}</text>'
        )
    if level is not None:
        at = float(axis(level))
        parts.append(
            f'<line class="level" x1="{at:.1f}" x2="{at:.1f}" y1="{top - 2:.1f}" y2="{height - 4:.1f}"/>'
        )
        anchor = "start" if at < WIDTH / 2 else "end"
        parts.append(
            f'<text class="note" x="{at:.1f}" y="{top - 6:.1f}" text-anchor="{anchor}">{escape(level_label)}</text>'
        )
    return "".join([*parts, "</svg>"])


def draw_changes(alt: str, rows: Sequence[Change], label: str) -> str:
    """Before and after of every row on a logarithmic axis; a tick marks the floor."""
    left = row_label_width([row.label for row in rows])
    values = [v for row in rows for v in (row.before, row.after, row.floor) if v is not None and v > 0.0]
    axis = Axis(*extent([np.array(values)], log=True), left + 8.0, WIDTH - 14.0, log=True)
    heights = row_heights([row.label for row in rows], ROW)
    bottom = 6.0 + sum(heights)
    parts = [opening(WIDTH, bottom + 38.0, alt)]
    for tick in axis.ticks(5):
        at = float(axis(tick))
        parts.append(f'<line class="grid" x1="{at:.1f}" x2="{at:.1f}" y1="4" y2="{bottom:.1f}"/>')
        parts.append(
            f'<text x="{at:.1f}" y="{bottom + 15:.1f}" text-anchor="middle">{number(tick, 3)}</text>'
        )
    parts.append(
        f'<text class="label" x="{(left + WIDTH) / 2:.1f}" y="{bottom + 31:.1f}" text-anchor="middle">{escape(label)}</text>'
    )
    below = 6.0
    for row, tall in zip(rows, heights, strict=True):
        y = below + 0.5 * tall
        below += tall
        parts.append(row_label(row.label, left - 4.0, y))
        start = float(axis(row.before))
        if row.floor is not None and row.floor > 0.0:
            at = float(axis(row.floor))
            parts.append(
                f'<line class="floor" x1="{at:.1f}" x2="{at:.1f}" y1="{y - 9:.1f}" y2="{y + 9:.1f}"/>'
            )
        if row.after is not None:
            end = float(axis(row.after))
            parts.append(f'<line class="join" x1="{start:.1f}" x2="{end:.1f}" y1="{y:.1f}" y2="{y:.1f}"/>')
            parts.append(f'<circle class="dot after" cx="{end:.1f}" cy="{y:.1f}" r="5"/>')
        parts.append(
            f'<rect class="dot before" x="{start - 4.5:.1f}" y="{y - 4.5:.1f}" width="9" height="9"/>'
        )
    return "".join([*parts, "</svg>"])
