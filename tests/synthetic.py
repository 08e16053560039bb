"""What synthetic machines are made with: signals, sensors, and scipy's integrator."""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

Array = NDArray[np.float64]
Signal = Callable[[float], float]


def sign(v: float, width: float) -> float:
    """The sign of a speed, turning over `width`."""
    return float(np.tanh(v / width))


def tones(rng: np.random.Generator, rms: float, low: float, high: float, count: int = 12) -> Signal:
    """A sum of sines of random frequency [Hz] and phase."""
    frequency = np.geomspace(low, high, count) * rng.uniform(0.9, 1.1, count)
    phase = rng.uniform(0.0, 2.0 * np.pi, count)
    size = rms * np.sqrt(2.0 / count)
    return lambda t: float(size * np.sin(2.0 * np.pi * frequency * t + phase).sum())


def moves(rng: np.random.Generator, travel: float, duration: float, dwell: float = 0.5) -> Signal:
    """Point-to-point moves with smooth (quintic) profiles and pauses between them."""
    times, places = [0.0], [0.0]
    while times[-1] < duration:
        times += [times[-1] + dwell * rng.uniform(0.5, 1.0), 0.0]
        times[-1] = times[-2] + rng.uniform(0.4, 1.5)
        places += [places[-1], rng.uniform(-travel, travel)]
    knots, values = np.array(times), np.array(places)

    def at(t: float) -> float:
        i = int(np.clip(np.searchsorted(knots, t, side="right") - 1, 0, len(knots) - 2))
        s = min(max((t - knots[i]) / (knots[i + 1] - knots[i]), 0.0), 1.0)
        return float(values[i] + (values[i + 1] - values[i]) * s**3 * (10.0 - 15.0 * s + 6.0 * s**2))

    return at


def integrate(
    rates: Callable[[float, Array], list[float]], start: list[float], time: Array, step: float
) -> Array:
    """States (n, q) at the times; `step` [s] is the longest that the integrator may take."""
    done = solve_ivp(
        rates, (time[0], time[-1]), start, t_eval=time, method="LSODA", rtol=1e-7, atol=1e-10, max_step=step
    )
    return done.y.T


def sampled(signal: Signal, time: Array) -> Array:
    return np.array([signal(t) for t in time])


def noisy(rng: np.random.Generator, value: Array, std: float) -> Array:
    return value + std * rng.standard_normal(len(value))


def rounded(value: Array, step: float) -> Array:
    return step * np.round(value / step)
