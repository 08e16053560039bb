"""Experiments drawn at random: what a careful experimenter might record, never twice the same.

Amplitudes are in units of the forcing's. Every set holds a multisine that repeats, a large chirp and the limit cycle
alone; the rest is drawn.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
RATE = 1000  # [Hz]
PUMPING = (0.7, 0.8, 1.0, 1.25, 1.5, 1.6, 2.0)  # [Hz] at which a multisine can repeat with the forcing


@dataclass(frozen=True)
class Run:
    """One record to be made: its name, duration [s], the forcing's scale, and the command's shape with its numbers."""

    name: str
    duration: float
    forcing: float
    shape: str
    numbers: dict[str, Any]

    @property
    def time(self) -> Array:
        """Instants [s] at which commands are sent and measurements taken."""
        return np.arange(round(self.duration * RATE)) / RATE

    @property
    def command(self) -> Array:
        """Commands [N] at those instants."""
        return SHAPES[self.shape](self.time, **self.numbers)


def _silence(time: Array) -> Array:
    return np.zeros(len(time))


def _chirp(time: Array, amplitude: float, low: float, high: float, sweep: float, phase: float) -> Array:
    t = time % sweep
    return amplitude * np.sin(2.0 * np.pi * (low * t + (high - low) * t * t / (2.0 * sweep)) + phase)


def _multisine(time: Array, rms: float, period: float, lines: list[int], phases: list[float]) -> Array:
    waves = [np.cos(2.0 * np.pi * k * time / period + phase) for k, phase in zip(lines, phases)]
    return rms * np.sqrt(2.0 / len(lines)) * np.sum(waves, axis=0)


def _steps(time: Array, level: float, begin: float, end: float) -> Array:
    return np.where((time >= begin) & (time < end), level, np.where(time >= end, -level, 0.0))


SHAPES = {"silence": _silence, "chirp": _chirp, "multisine": _multisine, "steps": _steps}


def _draw_chirp(
    rng: np.random.Generator, name: str, unit: float, natural: float, size: tuple[float, float]
) -> Run:
    duration = float(rng.integers(15, 31))
    ends = [rng.uniform(0.0, 0.3) * natural, rng.uniform(2.0, 3.2) * natural]
    low, high = ends if rng.random() < 0.6 else ends[::-1]
    sweep = duration if duration < 20.0 or rng.random() < 0.7 else 0.5 * duration
    numbers = {
        "amplitude": unit * rng.uniform(*size), "low": low, "high": high, "sweep": sweep,
        "phase": rng.uniform(0.0, 2.0 * np.pi),
    }  # fmt: skip
    return Run(name, duration, 1.0, "chirp", numbers)


def _draw_multisine(rng: np.random.Generator, name: str, unit: float, natural: float, pumping: float) -> Run:
    fitting = [p for p in (4.0, 5.0, 6.0, 8.0, 10.0) if abs(p * pumping - round(p * pumping)) < 1e-9]
    period = float(rng.choice(fitting))
    repeats = int(rng.integers(max(2, np.ceil(14.0 / period)), np.floor(30.0 / period) + 1))
    top = rng.uniform(2.0, 3.2) * natural
    lines = [int(k) for k in range(1, int(top * period) + 1, 2)]
    phases = [float(phase) for phase in rng.uniform(0.0, 2.0 * np.pi, len(lines))]
    numbers = {"rms": unit * rng.uniform(0.3, 0.7), "period": period, "lines": lines, "phases": phases}
    return Run(name, period * repeats, 1.0, "multisine", numbers)


def _draw_cycle(rng: np.random.Generator, name: str, scales: tuple[float, ...]) -> Run:
    return Run(name, float(rng.integers(10, 17)), float(rng.choice(scales)), "silence", {})


def _draw_steps(rng: np.random.Generator, name: str, unit: float) -> Run:
    duration = float(rng.integers(12, 21))
    begin = rng.uniform(1.0, 3.0)
    numbers = {
        "level": unit * rng.uniform(0.5, 2.0),
        "begin": begin,
        "end": begin + rng.uniform(0.3, 0.6) * duration,
    }
    return Run(name, duration, 1.0, "steps", numbers)


def draw_runs(
    rng: np.random.Generator, unit: float, natural: float, pumping: float
) -> tuple[tuple[Run, ...], tuple[Run, ...]]:
    """Three to six records to learn from and two to judge by.

    `unit` [N] is the forcing's amplitude, `natural` [Hz] the machine's frequency, `pumping` [Hz] the forcing's.
    """
    runs = [
        _draw_multisine(rng, "multisine", unit, natural, pumping),
        _draw_chirp(rng, "chirp_large", unit, natural, (0.8, 1.5)),
        _draw_cycle(rng, "cycle", (1.0, 2.0, 3.0)),
    ]
    more = [
        lambda: _draw_chirp(rng, "chirp_small", unit, natural, (0.1, 0.5)),
        lambda: _draw_cycle(rng, "cycle_scaled", (0.3, 0.5, 2.0, 3.0)),
        lambda: _draw_chirp(rng, "chirp_other", unit, natural, (0.3, 1.2)),
        lambda: _draw_steps(rng, "steps", unit),
    ]
    for index in rng.permutation(len(more))[: rng.integers(0, 4)]:
        runs.append(more[index]())
    held_out = (
        _draw_chirp(rng, "unseen_chirp", unit, natural, (0.3, 1.0)),
        Run(**{**vars(_draw_multisine(rng, "unseen_multisine", unit, natural, pumping)), "forcing": 2.0}),
    )
    return tuple(runs), held_out
