"""Maps over position and velocity: where in its states a machine departs from its model."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rhythmid.report.chart import Axis, linear_ticks, opening
from rhythmid.report.quantity import number

Array = NDArray[np.float64]
COLUMNS, ROWS = 28, 22
SHADES = 4  # steps of colour on either side of zero
FEWEST_IN_CELL = 3  # samples that a cell needs to be shown


@dataclass(frozen=True, eq=False)
class StateMap:
    """Mean of a signal in cells of position and velocity: float64[ROWS, COLUMNS], nan where too few samples fell.

    `x` and `v` are the edges of the cells.
    """

    x: Array
    v: Array
    mean: Array


def state_map(position: Array, velocity: Array, signal: Array) -> StateMap:
    """Average `signal` (n,) in cells of position and velocity that hold all but the outermost hundredths."""
    x = _edges(position, COLUMNS)
    v = _edges(velocity, ROWS)
    total = np.histogram2d(velocity, position, (v, x), weights=signal)[0]
    count = np.histogram2d(velocity, position, (v, x))[0]
    with np.errstate(invalid="ignore", divide="ignore"):
        mean = np.where(count >= FEWEST_IN_CELL, total / count, np.nan)
    return StateMap(x, v, mean)


def _edges(values: Array, count: int) -> Array:
    low, high = np.quantile(values, [0.01, 0.99])
    if high <= low:
        low, high = low - 0.5, high + 0.5
    return np.linspace(low, high, count + 1)


def draw_maps(
    alt: str,
    maps: list[tuple[str, StateMap]],
    x_unit: tuple[float, str],
    v_unit: tuple[float, str],
    unit: tuple[float, str],
) -> str:
    """The maps side by side on one scale of colour; units are (factor, name) of position, velocity and signal."""
    sizes = np.concatenate([np.abs(one.mean[np.isfinite(one.mean)]) for _, one in maps])
    largest = float(np.quantile(sizes, 0.98)) if len(sizes) else 1.0
    largest = largest or 1.0
    left, gap, top, tall = 50.0, 12.0, 34.0, 150.0
    wide = (400.0 - left - 10.0 - gap * (len(maps) - 1)) / len(maps)
    parts = [opening(400.0, 246.0, alt)]
    parts.append(f'<text class="label" x="4" y="12">v [{v_unit[1]}]</text>')
    for index, (name, one) in enumerate(maps):
        begin = left + index * (wide + gap)
        x = Axis(float(one.x[0]), float(one.x[-1]), begin, begin + wide)
        v = Axis(float(one.v[0]), float(one.v[-1]), top + tall, top)
        parts.append(f'<rect class="panel" x="{begin:.1f}" y="{top}" width="{wide:.1f}" height="{tall}"/>')
        parts.append(
            f'<text class="label" x="{begin + wide / 2:.1f}" y="{top - 8}" text-anchor="middle">{name}</text>'
        )
        parts += _cells(one, x, v, largest)
        for tick in linear_ticks(float(one.x[0]) * x_unit[0], float(one.x[-1]) * x_unit[0], 5):
            at = float(x(tick / x_unit[0]))
            parts.append(
                f'<text x="{at:.1f}" y="{top + tall + 14}" text-anchor="middle">{number(tick, 4)}</text>'
            )
        if index == 0:
            for tick in linear_ticks(float(one.v[0]) * v_unit[0], float(one.v[-1]) * v_unit[0], 5):
                at = float(v(tick / v_unit[0]))
                parts.append(
                    f'<text x="{begin - 6:.1f}" y="{at + 4:.1f}" text-anchor="end">{number(tick, 4)}</text>'
                )
    parts.append(
        f'<text class="label" x="{(left + 390) / 2:.0f}" y="{top + tall + 30}" text-anchor="middle">x [{x_unit[1]}]</text>'
    )
    parts += _scale(largest * unit[0], unit[1], left, top + tall + 44.0)
    return "".join([*parts, "</svg>"])


def _cells(one: StateMap, x: Axis, v: Axis, largest: float) -> list[str]:
    """One path a shade, runs of equal cells joined."""
    shade = np.full(one.mean.shape, -SHADES - 1)
    known = np.isfinite(one.mean)
    steps = one.mean[known] / largest * (SHADES + 0.5)
    shade[known] = np.clip(np.rint(steps), -SHADES, SHADES).astype(int)
    paths: dict[int, list[str]] = {}
    for row in range(ROWS):
        y0, y1 = float(v(one.v[row])), float(v(one.v[row + 1]))
        column = 0
        while column < COLUMNS:
            end = column + 1
            while end < COLUMNS and shade[row, end] == shade[row, column]:
                end += 1
            level = int(shade[row, column])
            if level >= -SHADES:
                x0, x1 = float(x(one.x[column])), float(x(one.x[end]))
                paths.setdefault(level, []).append(f"M{x0:.1f} {y1:.1f}H{x1:.1f}V{y0:.1f}H{x0:.1f}Z")
            column = end
    return [
        f'<path class="cell {shade_class(level)}" d="{"".join(d)}"/>' for level, d in sorted(paths.items())
    ]


def shade_class(level: int) -> str:
    """Class of the style sheet for a colour, `level` from -SHADES to SHADES."""
    return f"minus{-level}" if level < 0 else f"plus{level}"


def _scale(largest: float, unit: str, left: float, y: float) -> list[str]:
    count = 2 * SHADES + 1
    width = 22.0
    parts = []
    for i in range(count):
        parts.append(
            f'<rect class="cell {shade_class(i - SHADES)} edge" x="{left + 62 + i * width:.1f}" y="{y:.1f}" width="{width}" height="12"/>'
        )
    parts.append(f'<text x="{left + 56:.1f}" y="{y + 10:.1f}" text-anchor="end">{number(-largest, 3)}</text>')
    parts.append(
        f'<text x="{left + 68 + count * width:.1f}" y="{y + 10:.1f}">{number(largest, 3)} {unit}</text>'
    )
    return parts
