"""One record with the predictions of models, and their difference in time, in the cycle and in frequency."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from scipy.signal import welch

from rhythmid.motion_power import motion_power
from rhythmid.report.state_map import state_map
from rhythmid.statistics import NORMAL_95

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
Which = Literal["before", "after"]
SEGMENTS = 10  # a record is cut into for the uncertainty of its error
PHASES = 48  # parts of a cycle
FEWEST_SAMPLES = 16  # samples below which a record is not drawn


@dataclass(frozen=True)
class Compared:
    """The quantity in which a record is compared with a model.

    Parameters
    ----------
    quantity : "motion" or "effort"; errors are shares of it.
    unit : of the quantity.
    made : how a model obtains it: "simulated" or "predicted".
    bandwidth : frequency [Hz] below which it is compared; None without a filter.
    """

    quantity: str
    unit: str
    made: str = "simulated"
    bandwidth: float | None = None


@dataclass(frozen=True)
class Switch:
    """Where a model switches: at this `value` of `signal`, position "x" or velocity "v" [unit of the motion, or that per
    second]; `name` of the effect that does."""

    signal: Literal["x", "v"]
    value: float
    name: str


@dataclass(frozen=True, eq=False)
class Run:
    """A record with the predictions of models: the motion of a free run, or the effort that its motion needs.

    Attributes
    ----------
    name : of the record.
    time, measured : float64[n] [s] and what was measured as it was compared (averaged over a few samples, or filtered).
    before : float64[n] the same by the refitted nominal model; `after` by the augmented one, None where there is none.
    position, velocity : float64[n] motion of the mass, by the better model or as it was measured.
    phase : float64[n] phase of the forcing's cycle, 0 <= phase < 1, or None without forcing.
    used : bool[n] samples that count: those used in the fit or, if `heldout`, the held-out ones.
    hidden : bool[n] held-out samples of a record whose other samples were used in the fit.
    heldout : whether the whole record is held out.
    quiet : whether only the forcing drove the machine.
    size : reference of relative errors, if this is not the standard deviation of `measured` [its unit].
    labels : names of `before` and `after` in figures.
    switches : where the better model switches; None where `measured` is no position.
    """

    name: str
    time: Array
    measured: Array
    before: Array
    after: Array | None
    position: Array
    velocity: Array
    phase: Array | None
    used: Mask
    hidden: Mask
    heldout: bool = False
    quiet: bool = False
    size: float | None = None
    labels: tuple[str, str] = ("refitted nominal model", "with the added effect")
    switches: tuple[Switch, ...] | None = ()

    def residual(self, which: Which) -> Array:
        """Measured minus predicted, float64[n]."""
        said = self.after if which == "after" and self.after is not None else self.before
        return self.measured - said

    @property
    def step(self) -> float:
        """Time between samples [s]."""
        return float(np.median(np.diff(self.time)))


@dataclass(frozen=True)
class Error:
    """rms of a residual, the same as a share of the standard deviation of what was measured (or of the run's `size`), and the half-width
    of the 95 % interval of that ratio: how much it would differ in another stretch of the same kind."""

    rms: float
    ratio: float
    half: float | None


def error_of(runs: Sequence[Run], which: Which, hidden: bool = False) -> Error | None:
    """Error over all samples of the runs that count, or over the hidden ones; None where there are none."""
    squares: list[Array] = []
    spread = 0.0
    for run in runs:
        mask = run.hidden if hidden else run.used
        if not mask.any():
            continue
        squares.append(run.residual(which)[mask] ** 2)
        if run.size is None:
            spread += motion_power(run.measured, mask)
        else:
            spread += run.size**2 * int(mask.sum())
    if not squares or spread <= 0.0:
        return None
    joined = np.concatenate(squares)
    ratio = math.sqrt(float(joined.sum()) / spread)
    parts = [part.mean() for one in squares for part in np.array_split(one, SEGMENTS) if len(part)]
    half = None
    if len(parts) >= SEGMENTS and joined.mean() > 0.0:
        scatter = float(np.std(parts, ddof=1)) / math.sqrt(len(parts))
        half = NORMAL_95 * 0.5 * ratio * scatter / float(joined.mean())
    return Error(math.sqrt(float(joined.mean())), ratio, half)


def by_phase(run: Run, which: Which) -> tuple[Array, Array, Array] | None:
    """Mean residual in each part of the forcing's cycle and the standard deviation of that mean, by the scatter from cycle
    to cycle: phase (PHASES,) from 0 to 1, mean, std. None without forcing or with fewer than three cycles."""
    if run.phase is None:
        return None
    turn = np.concatenate([[0], np.cumsum(np.diff(run.phase) < -0.5)])
    part = np.minimum((run.phase * PHASES).astype(int), PHASES - 1)
    cycles = int(turn[-1]) + 1
    cell = (turn * PHASES + part)[run.used]
    count = np.bincount(cell, minlength=cycles * PHASES).reshape(cycles, PHASES)
    total = np.bincount(cell, run.residual(which)[run.used], cycles * PHASES).reshape(cycles, PHASES)
    filled = count > 0
    number = filled.sum(axis=0)
    if number.min() < 3:
        return None
    each = np.where(filled, total / np.maximum(count, 1), 0.0)
    mean = each.sum(axis=0) / number
    variance = np.where(filled, (each - mean) ** 2, 0.0).sum(axis=0) / (number - 1)
    return (np.arange(PHASES) + 0.5) / PHASES, mean, np.sqrt(variance / number)


def density(run: Run, signal: Array) -> tuple[Array, Array]:
    """Amplitude spectral density of a signal of the run: frequency [Hz], unit/√Hz; both (k,).

    P. D. Welch, IEEE Trans. Audio Electroacoust. 15 (1967) 70; over the longest stretch of samples that count.
    """
    edges = np.flatnonzero(np.diff(np.concatenate([[0], run.used.astype(np.int8), [0]])))
    begin, end = max(zip(edges[::2], edges[1::2]), key=lambda pair: pair[1] - pair[0])
    piece = signal[begin:end]
    frequency, power = welch(piece, 1.0 / run.step, nperseg=min(len(piece), max(256, len(piece) // 4)))
    return frequency[1:], np.sqrt(power[1:])


@dataclass(frozen=True)
class Harmonic:
    """Harmonic h of the forcing in a record's steady motion: measured amplitude, amplitude of each model's error,
    and the standard deviation of these [unit of the output]."""

    number: int
    measured: float
    before: float
    after: float | None
    std: float


def harmonics(run: Run, noise: float, highest: int = 4) -> list[Harmonic]:
    """Harmonics 1 … `highest` of a run; `noise` is the standard deviation of slow averages, per sample."""
    if run.phase is None:
        return []
    turns = run.phase[run.used]
    found = []
    columns = [np.ones(len(turns))]
    for h in range(1, highest + 1):
        columns += [np.cos(2 * np.pi * h * turns), np.sin(2 * np.pi * h * turns)]
    design = np.stack(columns, axis=1)

    def amplitudes(signal: Array) -> Array:
        solution = np.linalg.lstsq(design, signal[run.used], rcond=1e-10)[0]
        return np.hypot(solution[1::2], solution[2::2])

    measured, before = amplitudes(run.measured), amplitudes(run.residual("before"))
    after = amplitudes(run.residual("after")) if run.after is not None else None
    std = noise * math.sqrt(2.0 / len(turns))
    for index in range(highest):
        rest = None if after is None else float(after[index])
        found.append(Harmonic(index + 1, float(measured[index]), float(before[index]), rest, std))
    return found


@dataclass(frozen=True)
class Place:
    """Where a run differs most from the refitted nominal model.

    `time` [s] is the middle of the worst cycle (of the strongest line, without forcing), `phase` of the forcing's cycle
    (None without), `position` and `velocity` the states with the largest mean residual, `frequency` [Hz] the strongest line of
    the residual's spectrum and `share` what it carries of the residual's power.
    """

    run: Run
    time: float
    phase: float | None
    position: float
    velocity: float
    frequency: float
    share: float


def worst_place(runs: Sequence[Run]) -> Place | None:
    """Where the refitted nominal model differs most from the records."""
    candidates = [run for run in runs if run.used.sum() >= FEWEST_SAMPLES]
    if not candidates:
        return None
    run = max(candidates, key=lambda one: float(np.mean(one.residual("before")[one.used] ** 2)))
    residual = run.residual("before")
    frequency, amplitude = density(run, residual)
    line = int(np.argmax(amplitude))
    share = float(np.sum(amplitude[max(line - 1, 0) : line + 2] ** 2) / np.sum(amplitude**2))
    window = int(np.clip(1.0 / (frequency[line] * run.step), 3, len(residual) // 4))
    power = np.convolve(np.where(run.used, residual, 0.0) ** 2, np.ones(window), mode="same")
    cycle = by_phase(run, "before")
    phase = float(cycle[0][int(np.argmax(np.abs(cycle[1])))]) if cycle is not None else None
    states = state_map(run.position[run.used], run.velocity[run.used], residual[run.used])
    size = np.nan_to_num(np.abs(states.mean))
    row, column = np.unravel_index(int(np.argmax(size)), size.shape)
    return Place(
        run, float(run.time[int(np.argmax(power))]), phase, float(states.x[column : column + 2].mean()),
        float(states.v[row : row + 2].mean()), float(frequency[line]), share,
    )  # fmt: skip
