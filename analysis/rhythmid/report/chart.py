"""Line charts as inline SVG, coloured by the page's style sheet so that they follow its light and dark themes."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from html import escape

import numpy as np
from numpy.typing import NDArray

from rhythmid.report.quantity import number, scientific

Array = NDArray[np.float64]
WIDTH, HEIGHT = 400.0, 250.0  # small enough for readable text when a phone shrinks the drawing
LEFT, RIGHT, TOP, BOTTOM = 54.0, 12.0, 26.0, 42.0
FEWEST_TICKS, MOST_TICKS = 3, 9  # ticks: fewer are hard to read, more are crowded
COLUMN = 2.0  # pixels within which points of a curve are not distinguishable
MOST_OF_PATH = 400  # points of a path that are drawn


@dataclass(frozen=True, eq=False)
class Curve:
    """y over x, float64[n]; `style` is a class of the style sheet. `low` and `high` [n] bound a band around it."""

    x: Array
    y: Array
    label: str
    style: str
    dashed: bool = False
    low: Array | None = None
    high: Array | None = None


@dataclass(frozen=True, eq=False)
class Chart:
    """Curves over one pair of axes.

    `x_range` is the range of the data unless given. `shaded` are stretches (from, to) of x, `levels` horizontal lines (y),
    `uprights` vertical ones (x), `alt` the content of the chart in words for readers who cannot see it. Charts with the same `link`
    show the same range of x. A `path` is a curve whose x need not grow, such as an orbit.
    """

    alt: str
    x_label: str
    y_label: str
    curves: tuple[Curve, ...]
    y_log: bool = False
    x_log: bool = False
    shaded: tuple[tuple[float, float], ...] = ()
    levels: tuple[float, ...] = ()
    from_zero: bool = False
    x_range: tuple[float, float] | None = None
    uprights: tuple[float, ...] = ()
    link: str = ""
    path: bool = False

    @property
    def legend(self) -> tuple[tuple[str, str], ...]:
        """(style, label) of every labelled curve."""
        found = {
            curve.label: f"{curve.style} dashed" if curve.dashed else curve.style for curve in self.curves
        }
        return tuple((style, label) for label, style in found.items() if label)


@dataclass(frozen=True)
class Axis:
    """One axis: data range, pixels of its ends, ticks; with `whole` only whole numbers are marked."""

    low: float
    high: float
    begin: float
    end: float
    log: bool = False
    whole: bool = False

    def __call__(self, value: Array | float) -> Array:
        given = np.asarray(value, dtype=float)
        low, high = self.low, self.high
        if self.log:
            given = np.log10(np.maximum(given, 1e-300))
            low, high = math.log10(low), math.log10(high)
        return self.begin + (np.clip(given, low, high) - low) / (high - low) * (self.end - self.begin)

    def ticks(self, most: int = 6) -> list[float]:
        """Round values along the axis."""
        if self.log:
            first, last = math.floor(math.log10(self.low)), math.ceil(math.log10(self.high))
            for steps in ((1.0, 2.0, 5.0), (1.0,)):
                found = [m * 10.0**k for k in range(first, last + 1) for m in steps]
                found = [
                    tick for tick in found if self.low <= tick * (1 + 1e-9) and tick <= self.high * (1 + 1e-9)
                ]
                if len(found) <= most + 1:
                    return found
            return found[:: math.ceil(len(found) / most)]
        found = linear_ticks(self.low, self.high, most)
        return [tick for tick in found if tick == round(tick)] if self.whole else found


def linear_ticks(low: float, high: float, most: int = 6) -> list[float]:
    """Multiples of 1, 2 or 5 times a power of ten within [low, high], at most `most` or so."""
    rough = (high - low) / max(most - 1, 1)
    tens = 10.0 ** math.floor(math.log10(rough))
    step = next(m * tens for m in (1.0, 2.0, 5.0, 10.0) if m * tens >= rough * (1 - 1e-9))
    first, last = math.ceil(low / step - 1e-9), math.floor(high / step + 1e-9)
    if last - first < FEWEST_TICKS - 1 and most < MOST_TICKS:
        return linear_ticks(low, high, most + 1)
    return [k * step for k in range(first, last + 1)]


def extent(values: Sequence[Array], log: bool = False, from_zero: bool = False) -> tuple[float, float]:
    """Range of an axis that shows all finite values, with a margin."""
    joined = np.concatenate([np.ravel(v) for v in values]) if values else np.empty(0)
    joined = joined[np.isfinite(joined)]
    if log:
        joined = joined[joined > 0.0]
        if not len(joined):
            return 0.1, 1.0
        low, high = float(joined.min()), float(joined.max())
        low = max(low, 1e-7 * high)
        return low / 1.15, max(high * 1.15, low * 1.5)
    if not len(joined):
        return 0.0, 1.0
    low, high = float(joined.min()), float(joined.max())
    if from_zero:
        low, high = min(low, 0.0), max(high, 0.0)
    if high <= low:
        size = abs(low) or 1.0
        return low - 0.5 * size, high + 0.5 * size
    air = 0.05 * (high - low)
    return low - (0.0 if from_zero and low == 0.0 else air), high + (
        0.0 if from_zero and high == 0.0 else air
    )


def x_extent(chart: Chart) -> tuple[float, float]:
    """Range of x that shows the whole chart."""
    shown = [c for c in chart.curves if len(c.x)]
    if chart.x_range is not None:
        return chart.x_range
    given = [*(c.x for c in shown), *([np.array(chart.uprights)] if chart.uprights else [])]
    if chart.x_log or chart.path or not shown:
        return extent(given, chart.x_log)
    low, high = float(min(map(np.min, given))), float(max(map(np.max, given)))  # fill the width
    low = 0.0 if 0.0 < low < 0.1 * high else low
    return (low, high) if high > low else (low, low + 1.0)


def y_extent(chart: Chart) -> tuple[float, float]:
    """Range of y that shows the whole chart."""
    heights = [part for c in chart.curves for part in (c.y, c.low, c.high) if part is not None]
    return extent([*heights, np.array(chart.levels)], chart.y_log, chart.from_zero)


def draw(chart: Chart) -> str:
    """The chart as an SVG element."""
    shown = [c for c in chart.curves if len(c.x)]
    x_low, x_high = x_extent(chart)
    y_low, y_high = y_extent(chart)
    x = Axis(x_low, x_high, LEFT, WIDTH - RIGHT, chart.x_log)
    y = Axis(y_low, y_high, HEIGHT - BOTTOM, TOP, chart.y_log)
    parts = [opening(WIDTH, HEIGHT, chart.alt), *frame(x, y, chart.x_label, chart.y_label)]
    for begin, end in chart.shaded:
        left, right = float(x(begin)), float(x(end))
        parts.append(
            f'<rect class="shade" x="{left:.1f}" y="{TOP:.1f}" width="{max(right - left, 0.5):.1f}" '
            f'height="{HEIGHT - BOTTOM - TOP:.1f}"/>'
        )
    for curve in shown:
        parts.append(_path(curve, x, y) if chart.path else _curve(curve, x, y))
    for place in chart.uprights:
        at = float(x(place))
        parts.append(f'<line class="level" x1="{at:.1f}" x2="{at:.1f}" y1="{TOP}" y2="{HEIGHT - BOTTOM}"/>')
    for level in chart.levels:
        at = float(y(level))
        parts.append(f'<line class="level" x1="{LEFT}" x2="{WIDTH - RIGHT}" y1="{at:.1f}" y2="{at:.1f}"/>')
    return "".join([*parts, "</svg>"])


def opening(width: float, height: float, alt: str) -> str:
    """Start of a drawing that reads its description out instead of its parts."""
    return (
        f'<svg viewBox="0 0 {width:g} {height:g}" role="img" aria-label="{escape(alt, quote=True)}" '
        f'xmlns="http://www.w3.org/2000/svg"><title>{escape(alt)}</title>'
    )


def frame(x: Axis, y: Axis, x_label: str, y_label: str) -> list[str]:
    """Grid lines, tick labels and axis labels."""
    bottom, top = y.begin, y.end
    parts: list[str] = []
    for tick in y.ticks(5):
        at = float(y(tick))
        parts.append(f'<line class="grid" x1="{x.begin:.1f}" x2="{x.end:.1f}" y1="{at:.1f}" y2="{at:.1f}"/>')
        parts.append(
            f'<text x="{x.begin - 6:.1f}" y="{at + 4:.1f}" text-anchor="end">{_tick(tick, y)}</text>'
        )
    for tick in x.ticks(6):
        at = float(x(tick))
        parts.append(
            f'<line class="tick" x1="{at:.1f}" x2="{at:.1f}" y1="{bottom:.1f}" y2="{bottom + 4:.1f}"/>'
        )
        parts.append(f'<text x="{at:.1f}" y="{bottom + 16:.1f}" text-anchor="middle">{_tick(tick, x)}</text>')
    parts.append(
        f'<line class="axis" x1="{x.begin:.1f}" x2="{x.end:.1f}" y1="{bottom:.1f}" y2="{bottom:.1f}"/>'
    )
    parts.append(
        f'<text class="label" x="{(x.begin + x.end) / 2:.1f}" y="{bottom + 35:.1f}" text-anchor="middle">{escape(x_label)}</text>'
    )
    parts.append(f'<text class="label" x="4" y="{top - 10:.1f}">{escape(y_label)}</text>')
    return parts


def _tick(value: float, axis: Axis) -> str:
    if abs(value) < 1e-9 * max(abs(axis.low), abs(axis.high)) and not axis.log:
        return "0"
    # all ticks of a logarithmic axis are written alike
    low, high = (axis.low, axis.high) if axis.log else (abs(value), abs(value))
    if high >= 1e5 or low < 1e-3:
        return scientific(value, 3).replace(" × ", "·").removeprefix("1·")
    return number(value, 5)


def _points(x: Array, y: Array) -> str:
    return "L".join(f"{a:.1f} {b:.1f}" for a, b in zip(x, y))


def _envelope(x: Array, y: Array, columns: int) -> tuple[Array, Array, Array]:
    """Smallest and largest y (k,) in each of about `columns` columns of pixels."""
    edges = np.unique(np.linspace(0, len(x), columns + 1).astype(int))
    low = np.minimum.reduceat(y, edges[:-1])
    high = np.maximum.reduceat(y, edges[:-1])
    return x[edges[:-1]], low, high


def _curve(curve: Curve, x: Axis, y: Axis) -> str:
    dash = " dashed" if curve.dashed else ""
    columns = int(abs(x.end - x.begin) / COLUMN)
    parts = []
    for piece in _unbroken(np.isfinite(curve.y)):
        across, up = x(curve.x[piece]), y(curve.y[piece])
        if curve.low is not None and curve.high is not None:
            low, high = y(curve.low[piece]), y(curve.high[piece])
            parts.append(f'<path class="band {curve.style}" d="{_ring(across, low, high)}"/>')
        if len(across) > 6 * columns:  # more samples than pixels: their envelope
            parts.append(f'<path class="cover {curve.style}" d="{_ring(*_envelope(across, up, columns))}"/>')
        else:
            parts.append(f'<path class="line {curve.style}{dash}" d="M{_points(*_visible(across, up))}"/>')
    return "".join(parts)


def _visible(x: Array, y: Array) -> tuple[Array, Array]:
    """The distinguishable points of a curve: the lowest and the highest in each column of pixels."""
    if len(x) < 3:
        return x, y
    column = np.floor(x / COLUMN)
    edges = np.flatnonzero(np.diff(column, prepend=-np.inf))
    order = np.lexsort((y, column))
    last = np.append(edges[1:], len(x)) - 1
    kept = np.unique(np.concatenate([order[edges], order[last], [0, len(x) - 1]]))
    return x[kept], y[kept]


def _path(curve: Curve, x: Axis, y: Axis) -> str:
    """An orbit, thinned to points that are distinguishable on paper."""
    dash = " dashed" if curve.dashed else ""
    kept = np.isfinite(curve.x) & np.isfinite(curve.y)
    stride = max(1, int(kept.sum()) // MOST_OF_PATH)
    points = _points(x(curve.x[kept][::stride]), y(curve.y[kept][::stride]))
    return f'<path class="line {curve.style}{dash}" d="M{points}"/>' if points else ""


def _unbroken(known: NDArray[np.bool_]) -> list[slice]:
    """Stretches of two or more values that are known."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], known.astype(np.int8), [0]])))
    return [slice(int(a), int(b)) for a, b in zip(edges[::2], edges[1::2]) if b - a > 1]


def _ring(x: Array, low: Array, high: Array) -> str:
    return f"M{_points(np.concatenate([x, x[::-1]]), np.concatenate([high, low[::-1]]))}Z"
