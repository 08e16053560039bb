"""Possible missing forces as free functions of the recorded signals: columns that a fit combines."""

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import BSpline
from scipy.optimize import fminbound

from rhythmid.compare.channel_corrections import late_by
from rhythmid.compare.pair import Pair

Array = NDArray[np.float64]
SPLINES = 8  # basis functions of one quantity
HARMONICS = 6  # harmonics of a function of the forcing's phase


def _splines(values: Array, count: int) -> Array | None:
    """Cubic B-splines over the values without the outermost thousandths, (n, count)."""
    low, high = np.quantile(values, [0.001, 0.999])
    if not high > low:
        return None
    inner = np.linspace(low, high, count - 2)
    knots = np.concatenate([[low] * 3, inner, [high] * 3])
    inside = np.clip(values, low, high - 1e-9 * (high - low))
    return np.asarray(BSpline.design_matrix(inside, knots, 3).toarray())


def force_functions(pair: Pair, late: float) -> list[tuple[str, str, int, Array]]:
    """Functions that a missing force may depend on: (name, slot, rank of complexity, columns (n, q)).

    `late` [s] is the delay of the measured motion relative to the forces.
    """
    x, v = pair.recording, pair.velocity
    acting = None if pair.effort is None else _splines(late_by(pair.effort, late, pair), SPLINES)
    calm, a, b = _splines(pair.time, 4), _splines(x, 5), _splines(v, 5)
    changing = None if calm is None else np.hstack([calm, calm * (x - x.mean())[:, None]])
    both = None if a is None or b is None else (a[:, :, None] * b[:, None, :]).reshape(len(x), -1)
    cycle = None
    if pair.phase is not None:
        angle = 2.0 * np.pi * np.multiply.outer(pair.phase, np.arange(1, HARMONICS + 1))
        cycle = np.hstack([np.cos(angle), np.sin(angle)])
    found = [
        ("position", "force", 2, _splines(x, SPLINES)),
        ("velocity", "force", 2, _splines(v, SPLINES)),
        ("actuator force", "actuator", 2, acting),
        ("position, changing with time", "force", 3, changing),
        ("position and velocity", "force", 4, both),
        ("phase of the forcing", "force", 5, cycle),
        ("time", "force", 5, _splines(pair.time, SPLINES)),
    ]
    return [(name, slot, rank, columns) for name, slot, rank, columns in found if columns is not None]


def foreign_line(pair: Pair, residual: Array) -> tuple[float, Array] | None:
    """Frequency [Hz] of the strongest line in a residual (n,) that is no harmonic of the forcing, and its sine and cosine (n, 2)."""
    n = len(residual)
    resolution = 1.0 / (n * pair.step)
    power = np.abs(np.fft.rfft((residual - residual.mean()) * np.hanning(n), 4 * n)) ** 2
    frequency = np.arange(len(power)) * resolution / 4.0
    power[frequency < 2.0 * resolution] = 0.0
    if pair.pumping is not None:
        distance = np.abs(frequency - pair.pumping * np.rint(frequency / pair.pumping))
        power[distance < 2.0 * resolution] = 0.0
    if not power.any():
        return None
    best = float(frequency[int(np.argmax(power))])

    def waves(at: float) -> Array:
        angle = 2.0 * np.pi * at * pair.time
        return np.column_stack([np.cos(angle), np.sin(angle)])

    def left(at: float) -> float:
        columns = waves(at)
        return float(np.sum((residual - columns @ np.linalg.lstsq(columns, residual, rcond=None)[0]) ** 2))

    found = float(np.asarray(fminbound(left, best - resolution, best + resolution)))
    return found, waves(found)
