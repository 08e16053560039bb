"""Estimates of one quantity from many runs, each with its interval: points with bars, a colour and shape for each group."""

from collections.abc import Sequence
from dataclasses import dataclass
from html import escape

import numpy as np

from rhythmid.report.chart import BOTTOM, HEIGHT, LEFT, RIGHT, TOP, WIDTH, Axis, extent, frame, opening
from rhythmid.report.quantity import number

COLOURS = ("after", "before", "third", "measured")
SHAPES = ("circle", "square")
LARGE, SMALL, MANY = 4.0, 2.5, 60  # radius of a mark, of one among more than so many
NARROW_SPREAD = 1e-3  # spread as a share of the mean below which differences from it are drawn


@dataclass(frozen=True)
class Point:
    """An estimate: where it stands, its value, half of its 95 % interval, its group, and what it is called."""

    x: float
    y: float
    half: float
    group: str
    label: str


def style(group: int) -> str:
    """Shape and colour of the group with this number; they repeat after eight."""
    return f"{SHAPES[group // len(COLOURS) % len(SHAPES)]} {COLOURS[group % len(COLOURS)]}"


def draw_runs(alt: str, x_label: str, y_label: str, points: Sequence[Point], mean: float) -> str:
    """Points over x about their mean, which is a dotted line. Values that differ by little are drawn as differences from it."""
    groups = list(dict.fromkeys(point.group for point in points))
    ends = [np.array([point.y - point.half, point.y + point.half]) for point in points]
    low, high = extent([*ends, np.array([mean])])
    shift = mean if high - low < NARROW_SPREAD * abs(mean) else 0.0
    numbered = all(point.x == round(point.x) for point in points)  # runs, not times
    x = Axis(*_with_air([point.x for point in points]), LEFT, WIDTH - RIGHT, whole=numbered)
    y = Axis(low - shift, high - shift, HEIGHT - BOTTOM, TOP)
    said = f"{y_label} above {number(shift, 7)}" if shift else y_label
    parts = [opening(WIDTH, HEIGHT, alt), *frame(x, y, x_label, said)]
    middle = float(y(mean - shift))
    parts.append(
        f'<line class="level" x1="{LEFT}" x2="{WIDTH - RIGHT}" y1="{middle:.1f}" y2="{middle:.1f}"/>'
    )
    size = SMALL if len(points) > MANY else LARGE
    for point in points:
        across, up = float(x(point.x)), float(y(point.y - shift))
        top, bottom = float(y(point.y + point.half - shift)), float(y(point.y - point.half - shift))
        shape, colour = style(groups.index(point.group)).split()
        mark = (
            f'<circle class="dot" cx="{across:.1f}" cy="{up:.1f}" r="{size:g}"/>'
            if shape == "circle"
            else f'<rect class="dot" x="{across - size:.1f}" y="{up - size:.1f}" width="{2 * size:g}" height="{2 * size:g}"/>'
        )
        parts.append(
            f'<g class="{colour}"><title>{escape(point.label)}</title>'
            f'<line class="line" x1="{across:.1f}" x2="{across:.1f}" y1="{top:.1f}" y2="{bottom:.1f}"/>{mark}</g>'
        )
    return "".join([*parts, "</svg>"])


def _with_air(values: Sequence[float]) -> tuple[float, float]:
    """A range with room for a mark at either end."""
    low, high = min(values), max(values)
    air = 0.04 * (high - low) or 0.5
    return low - air, high + air
