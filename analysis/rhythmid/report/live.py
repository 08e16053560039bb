"""A chart's data for the page's script: compact, and limited to a maximum size of the page."""

import base64
import json
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rhythmid.report.chart import Chart, Curve, x_extent, y_extent

Array = NDArray[np.float64]
BUDGET = 700_000  # approximate maximum of bytes for the curves of all charts of a page
VALUE = 2.7  # bytes of one value: two, in base 64
FEWEST_POINTS = 400  # points of a curve that are always kept: about one for each pixel of a phone
MISSING = 65535  # code of an unknown value
LEVELS = 65534.0  # steps in which a curve's range is stored, far finer than a screen shows
UNEVEN = 1e-6  # share of a step by which samples may deviate from an even grid


def most_points(charts: Sequence[Chart], budget: float = BUDGET) -> int:
    """Points that a curve may have for all charts to keep within the budget [bytes]; longer curves are thinned."""
    sizes = [size for chart in charts for size in _sizes(chart)]
    if VALUE * sum(sizes) <= budget:
        return max(sizes, default=FEWEST_POINTS)
    low, high = FEWEST_POINTS, max(sizes)
    while high - low > 1:
        middle = (low + high) // 2
        low, high = (middle, high) if VALUE * sum(min(n, middle) for n in sizes) <= budget else (low, middle)
    return low


def _sizes(chart: Chart) -> list[int]:
    """Number of values of everything that is stored of a chart; one of x counts twice where x is not even."""
    parts = [part for c in chart.curves for part in (c.y, c.low, c.high) if part is not None]
    if chart.path:
        parts += [curve.x for curve in chart.curves]
    elif chart.curves and _even(chart.curves[0].x) is None:
        parts += [chart.curves[0].x] * 2
    return [len(part) for part in parts]


def chart_data(chart: Chart, most: int) -> str:
    """The chart as JSON that is safe within a script element; `most` is the number of points that a curve may have."""
    curves = _as_paths(chart, most) if chart.path else _over_common_x(chart, most)
    told = {
        "alt": chart.alt,
        "path": chart.path,
        "link": chart.link,
        "x": {"label": chart.x_label, "log": chart.x_log, "range": x_extent(chart)},
        "y": {"label": chart.y_label, "log": chart.y_log, "range": y_extent(chart), "zero": chart.from_zero},
        "shaded": chart.shaded,
        "levels": chart.levels,
        "uprights": chart.uprights,
        **curves,
    }
    text = json.dumps(told, separators=(",", ":"), allow_nan=False)
    # a name from a recording can neither end the element nor begin a comment
    return text.replace("<", "\\u003c").replace(">", "\\u003e").replace("&", "\\u0026")


def _over_common_x(chart: Chart, most: int) -> dict[str, Any]:
    shown = [curve for curve in chart.curves if len(curve.x)]
    if not shown:
        return {"xs": _grid(np.empty(0), most), "curves": []}
    same = all(np.array_equal(curve.x, shown[0].x) for curve in shown)
    x = shown[0].x if same else np.unique(np.concatenate([curve.x for curve in shown]))

    def stored(curve: Curve, part: Array | None) -> dict[str, Any] | None:
        if part is None:
            return None
        values = part if same else np.interp(x, curve.x, part, left=np.nan, right=np.nan)
        return _values(_extremes(values, most), chart.y_log)

    return {
        "xs": _grid(x, most),
        "curves": [
            _name(curve)
            | {
                "y": stored(curve, curve.y),
                "low": stored(curve, curve.low),
                "high": stored(curve, curve.high),
            }
            for curve in shown
        ],
    }


def _as_paths(chart: Chart, most: int) -> dict[str, Any]:
    made = []
    for curve in chart.curves:
        stride = max(1, -(-len(curve.x) // most))
        made.append(_name(curve) | {"x": _values(curve.x[::stride]), "y": _values(curve.y[::stride])})
    return {"curves": made}


def _name(curve: Curve) -> dict[str, Any]:
    return {"label": curve.label, "style": curve.style, "dashed": curve.dashed}


def _stretch(count: int, most: int) -> int:
    """Samples of a stretch of which two points are kept; a multiple of four, so that these are evenly spaced."""
    return 4 * -(-count // (2 * most))


def _extremes(y: Array, most: int) -> Array:
    """The smallest and the largest value of every interval, in their order in time."""
    if len(y) <= most:
        return y
    kept = []
    for piece in np.split(y, range(width := _stretch(len(y), most), len(y), width)):
        if np.isnan(piece).all():
            kept += [np.nan, np.nan]
            continue
        low, high = sorted((int(np.nanargmin(piece)), int(np.nanargmax(piece))))
        kept += [piece[low], piece[high]]
    return np.array(kept)


def _even(x: Array) -> tuple[float, float] | None:
    """First point and step of evenly spaced points; None for others."""
    if len(x) < 2:
        return None
    step = float(x[-1] - x[0]) / (len(x) - 1)
    off = float(np.max(np.abs(x - x[0] - step * np.arange(len(x)))))
    return (float(x[0]), step) if off < UNEVEN * step else None


def _grid(x: Array, most: int) -> dict[str, Any]:
    """Increasing points, thinned as by `_extremes`: first point and step if they are even, else single precision."""
    even, places = _even(x), np.arange(len(x))
    if len(x) > most:
        width = _stretch(len(x), most)
        places = np.arange(width // 4, 2 * -(-len(x) // width) * (width // 2), width // 2)
    if even is not None:
        first, step = even
        apart = float(places[1] - places[0])
        return {"count": len(places), "first": first + step * float(places[0]), "step": step * apart}
    origin = float(x[0]) if len(x) else 0.0
    return {"first": origin, "float32": _base64((x[np.minimum(places, len(x) - 1)] - origin).astype("<f4"))}


def _values(y: Array, log: bool = False) -> dict[str, Any]:
    """Values in 65534 steps between the smallest and the largest, of their logarithms where `log`."""
    with np.errstate(divide="ignore", invalid="ignore"):
        y = np.log10(y) if log else y
    known = np.isfinite(y)
    low, high = (float(y[known].min()), float(y[known].max())) if known.any() else (0.0, 0.0)
    step = (high - low) / LEVELS or 1.0
    steps = np.full(len(y), MISSING, dtype="<u2")
    steps[known] = np.rint((y[known] - low) / step).astype("<u2")
    return {"low": low, "step": step, "log": log, "uint16": _base64(steps)}


def _base64(values: NDArray[Any]) -> str:
    return base64.b64encode(values.tobytes()).decode("ascii")
