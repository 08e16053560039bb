"""Randomly drawn experiments, such as a careful experimenter might record.

Amplitudes are in units of the forcing's. Every set contains a repeated multisine, a large chirp and the limit cycle alone; the rest
is drawn.
"""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
RATE = 1000  # [Hz]
NEARBY = 1e-5  # [s] step of the differences for the rate of a smooth command
PUMPING = (
    0.7,
    0.8,
    1.0,
    1.25,
    1.5,
    1.6,
    2.0,
)  # [Hz] at which a multisine can have a common period with the forcing


@dataclass(frozen=True)
class Run:
    """One record to be made: its name, duration [s], the forcing's scale, and the command's shape with its numbers.

    `rate` [Hz] is that of commands and measurements. `start`, position [m] and velocity [m/s], is where the machine is released;
    None where it is already running.
    """

    name: str
    duration: float
    forcing: float
    shape: str
    numbers: dict[str, Any]
    rate: int = RATE
    start: tuple[float, float] | None = None

    @property
    def time(self) -> Array:
        """Instants [s] at which commands are sent and measurements taken."""
        return np.arange(round(self.duration * self.rate)) / self.rate

    @property
    def command(self) -> Array:
        """Commands [N] at those instants."""
        return SHAPES[self.shape](self.time, **self.numbers)

    @property
    def slopes(self) -> Array:
        """Rates [N/s] of a smooth command at those instants."""
        ahead, behind = (SHAPES[self.shape](self.time + side, **self.numbers) for side in (NEARBY, -NEARBY))
        return (ahead - behind) / (2.0 * NEARBY)


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


def _tones(time: Array, sizes: list[float], frequencies: list[float], phases: list[float]) -> Array:
    waves = [a * np.sin(2.0 * np.pi * f * time + phase) for a, f, phase in zip(sizes, frequencies, phases)]
    return np.sum(waves, axis=0)


def _moves(time: Array, times: list[float], places: list[float]) -> Array:
    """Moves between places with quintic profiles; equal neighbours are pauses."""
    knots, values = np.array(times), np.array(places)
    i = np.clip(np.searchsorted(knots, time, side="right") - 1, 0, len(knots) - 2)
    s = np.clip((time - knots[i]) / (knots[i + 1] - knots[i]), 0.0, 1.0)
    return values[i] + (values[i + 1] - values[i]) * s**3 * (10.0 - 15.0 * s + 6.0 * s * s)


def _speeds(time: Array, times: list[float], places: list[float]) -> Array:
    """Velocities of such moves."""
    knots, values = np.array(times), np.array(places)
    i = np.clip(np.searchsorted(knots, time, side="right") - 1, 0, len(knots) - 2)
    span = knots[i + 1] - knots[i]
    s = np.clip((time - knots[i]) / span, 0.0, 1.0)
    return (values[i + 1] - values[i]) / span * 30.0 * (s * (1.0 - s)) ** 2


SHAPES = {
    "silence": _silence, "chirp": _chirp, "multisine": _multisine, "steps": _steps, "tones": _tones, "moves": _moves,
    "speeds": _speeds,
}  # fmt: skip
Start = tuple[float, float]


def draw_tones(
    rng: np.random.Generator, name: str, rms: float, low: float, high: float, duration: float, rate: int,
    count: int = 12, falls: float = 0.0, start: Start | None = (0.0, 0.0),
) -> Run:  # fmt: skip
    """Sines between two frequencies [Hz], together of `rms` [N]; the amplitude of each falls with the power `falls` of frequency."""
    frequencies = np.geomspace(low, high, count) * rng.uniform(0.94, 1.06, count)
    sizes = frequencies**-falls
    sizes *= rms / np.sqrt(0.5 * np.sum(sizes**2))
    phases = rng.uniform(0.0, 2.0 * np.pi, count)
    numbers = {"sizes": sizes.tolist(), "frequencies": frequencies.tolist(), "phases": phases.tolist()}
    return Run(name, duration, 1.0, "tones", numbers, rate, start)


def draw_moves(
    rng: np.random.Generator, name: str, places: tuple[float, float], duration: float, rate: int,
    quickest: float = 0.4, slowest: float = 1.5, pause: float = 0.5, speeds: bool = False,
) -> Run:  # fmt: skip
    """Moves between random places [m], each of `quickest` to `slowest` [s], with pauses of up to `pause` [s]; or their velocities.

    They begin at the machine's rest position, in the middle of the places.
    """
    times, stops = [0.0], [0.5 * (places[0] + places[1])]
    while times[-1] < duration:
        times.append(times[-1] + pause * rng.uniform(0.3, 1.0))
        times.append(times[-1] + rng.uniform(quickest, slowest))
        stops += [stops[-1], float(rng.uniform(*places))]
    shape = "speeds" if speeds else "moves"
    return Run(name, duration, 1.0, shape, {"times": times, "places": stops}, rate, (stops[0], 0.0))


def draw_sweep(
    rng: np.random.Generator, name: str, amplitude: float, low: float, high: float, duration: float, rate: int,
    start: Start | None = (0.0, 0.0),
) -> Run:  # fmt: skip
    """One sweep up or down between two frequencies [Hz]."""
    ends = (low, high) if rng.random() < 0.6 else (high, low)
    numbers = {"amplitude": amplitude, "low": ends[0], "high": ends[1], "sweep": duration, "phase": 0.0}
    return Run(name, duration, 1.0, "chirp", numbers, rate, start)


def from_reference(run: Run) -> Run:
    """The same record, started at the first value of its command, a position."""
    return replace(run, start=(float(run.command[0]), 0.0))


def draw_release(name: str, start: Start, duration: float, rate: int) -> Run:
    """A release at `start` without a command."""
    return Run(name, duration, 1.0, "silence", {}, rate, start)


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
    """Three to six records to fit and two to judge by.

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
