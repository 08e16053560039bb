"""Continuous-time signals: every sampled command or forcing becomes a piecewise polynomial of degree <= 3.

The behaviour of a sampled signal between its samples (its *hold*) is physics: a command over a topic is held until
the next one arrives (zero order), a measured voltage is band-limited. `scipy.interpolate.PPoly` represents all of
them.
"""

from typing import Literal

import numpy as np
from numpy.typing import NDArray
from scipy.fft import next_fast_len
from scipy.interpolate import CubicHermiteSpline, CubicSpline, PPoly

Hold = Literal["zero", "linear", "band_limited"]
Array = NDArray[np.float64]

FAR = 1e300  # [s]; stands for "for ever" in the compiled simulator, where inf - inf would be NaN
OVERSAMPLING = 4  # number of cubic pieces per sample, for a signal up to its Nyquist frequency
FOR_EVER = FAR / 2  # [s] a later knot is no time: the last value is held for ever


def zero_order_hold(time: Array, value: Array) -> PPoly:
    """Signal that keeps each value [any unit] from its time [s] until the next; shapes (n,), (n,)."""
    knots = np.append(time, time[-1] + FAR)
    return PPoly(np.asarray(value, dtype=float)[None, :], knots, extrapolate=True)


def first_order_hold(time: Array, value: Array) -> PPoly:
    """Signal that connects the samples with straight lines; shapes (n,), (n,), n >= 2."""
    slope = np.diff(value) / np.diff(time)
    return PPoly(np.vstack([slope, value[:-1]]), np.asarray(time, dtype=float), extrapolate=True)


def spline(time: Array, value: Array) -> PPoly:
    """Cubic spline through the samples: a smooth, well-oversampled signal such as the forcing; n >= 2."""
    if len(time) < 4:
        return first_order_hold(time, value)
    fitted = CubicSpline(time, value)
    return PPoly(fitted.c, fitted.x, extrapolate=True)


def band_limited(time: Array, value: Array, oversampling: int = OVERSAMPLING) -> PPoly:
    """Reconstruct a uniformly sampled band-limited signal (anti-alias filtered measurement); n >= 4.

    Where samples are missing, the stretches on either side are reconstructed separately and joined by a straight line.
    """
    step = np.diff(time)
    broken = np.flatnonzero(step > 1.5 * float(np.median(step)))
    if len(broken) == 0:
        return _band_limited(time, value, oversampling)
    knots: list[Array] = []
    coefficients: list[Array] = []
    for first, end in zip([0, *(broken + 1)], [*(broken + 1), len(time)], strict=True):
        if end - first >= 4:
            part = _band_limited(time[first:end], value[first:end], oversampling)
        elif end - first >= 2:
            part = first_order_hold(time[first:end], value[first:end])
        else:
            part = None
        if part is not None:
            knots.append(part.x[:-1])
            coefficients.append(np.vstack([np.zeros((4 - len(part.c), part.c.shape[1])), part.c]))
        if end < len(time):
            slope = (value[end] - value[end - 1]) / (time[end] - time[end - 1])
            knots.append(time[end - 1 : end])
            coefficients.append(np.array([[0.0], [0.0], [slope], [value[end - 1]]]))
    return PPoly(np.hstack(coefficients), np.append(np.concatenate(knots), time[-1]), extrapolate=True)


def _band_limited(time: Array, value: Array, oversampling: int) -> PPoly:
    """Reconstruct evenly spaced samples.

    The samples are mirrored oddly at both ends, so that the periodic continuation has no jump, interpolated with the
    discrete Fourier transform on an `oversampling` times finer grid together with the derivative, and joined by cubic
    Hermite pieces.
    """
    n = len(value)
    period = (time[-1] - time[0]) / (n - 1)
    line = value[0] + (value[-1] - value[0]) * np.arange(n) / (n - 1)
    departure = value - line
    mirrored = np.concatenate([departure, -departure[-2:0:-1]])
    spectrum = np.fft.rfft(mirrored)
    fine = len(mirrored) * oversampling
    padded = np.zeros(fine // 2 + 1, dtype=complex)
    padded[: len(spectrum)] = spectrum
    padded[len(spectrum) - 1] *= 0.5  # the Nyquist line is shared by +f and -f on the finer grid
    omega = 2 * np.pi * np.arange(fine // 2 + 1) / (len(mirrored) * period)
    keep = (n - 1) * oversampling + 1
    values = np.fft.irfft(padded, fine)[:keep] * oversampling
    slopes = np.fft.irfft(1j * omega * padded, fine)[:keep] * oversampling
    grid = time[0] + period * np.arange(keep) / oversampling
    values = values + np.interp(grid, time, line)
    slopes = slopes + (value[-1] - value[0]) / (time[-1] - time[0])
    fitted = CubicHermiteSpline(grid, values, slopes)
    return PPoly(fitted.c, fitted.x, extrapolate=True)


def continuous(time: Array, value: Array, hold: Hold) -> PPoly:
    """Signal from samples by the named hold."""
    return {"zero": zero_order_hold, "linear": first_order_hold, "band_limited": band_limited}[hold](
        time, value
    )


def impulse_preserving(held: PPoly) -> PPoly:
    """Smooth surrogate for a zero-order-held command that is sampled far above the machine's dynamics.

    It is the derivative of a cubic spline through the command's integral at its knots. It has the same impulse, so
    its effect on a mass is the same, and an integrator need not stop at every knot. The integral has a kink at
    every knot. The low-frequency content of these kinks is a twelfth of the second difference, which is added.
    """
    knots, values = held.x[:-1], held.c[-1]
    step = float(np.median(np.diff(knots)))
    padding = step * np.arange(-8, 0)
    grid = np.concatenate([knots[0] + padding, knots, [knots[-1] + step]])
    level = np.concatenate([np.zeros(len(padding)), values])
    impulse = np.concatenate([[0.0], np.cumsum(level * np.diff(grid))])
    impulse[1:-1] += step / 12.0 * np.diff(level)
    slopes = CubicSpline(grid, impulse, bc_type=((1, 0.0), (1, float(values[-1])))).derivative()  # pyright: ignore[reportArgumentType]
    return PPoly(slopes.c, slopes.x, extrapolate=True)


def fast_length(least: int) -> int:
    """Length, at least `least`, for which a Fourier transform is fast."""
    return next_fast_len(least, True) or least


def is_held(signal: PPoly) -> bool:
    """Whether a signal keeps each value until the next one."""
    return signal.c.shape[0] == 1


def is_smooth(signal: PPoly) -> bool:
    """Whether a signal has no corners at its knots, except where samples are missing."""
    return signal.c.shape[0] == 4


def pieces(signal: PPoly | None) -> tuple[Array, Array]:
    """Knots (K+1,) and coefficients, lowest power first, extended over all time: (1, K) of a held signal, else (4, K).

    Before the first knot a zero-order-held signal is 0 (no command has arrived yet), a smooth one keeps its first
    value; after the last knot each keeps its last value. None is the zero signal.
    """
    if signal is None:
        return np.array([-FAR, FAR]), np.zeros((1, 1))
    held, ends = is_held(signal), signal.x[-1] <= FOR_EVER
    count = signal.c.shape[1]
    coefficients = np.zeros((1 if held else 4, 1 + count + ends))
    coefficients[: len(signal.c), 1 : 1 + count] = signal.c[::-1]
    if not held:
        coefficients[0, 0] = coefficients[0, 1]
    if ends:
        coefficients[0, -1] = float(signal(signal.x[-1]))
    knots = signal.x if ends else signal.x[:-1]
    return np.concatenate([[-FAR], knots, [FAR]]), coefficients
