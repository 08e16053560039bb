"""Multiple shooting: windows of a record, each with an initial state of its own.

H. G. Bock, Progress in Scientific Computing 2 (1983) 95. The free run of a machine that integrates, or is unstable,
accumulates every small disturbance and model error until it is meaningless. In short windows it stays near the
data.
"""

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy.interpolate import PPoly

from rhythmid.identify.descent import first_guess
from rhythmid.identify.free_run import prepare_run
from rhythmid.identify.series import (
    Array,
    Series,
    displacement,
    dominant_frequency,
    longest_of_each,
    record_of,
)
from rhythmid.model import Model
from rhythmid.simulation.signal import first_order_hold

MARGIN = 1.0  # [s] of a command kept before a window, for delays
PUSH = 1e-3  # constant test force as a share of the machine's inertial force
# growth of the effect of the test force, from the middle to the end of a record, above which windows are needed:
# growth proportional to time gives 2.1
GROWTH = 1.5
# share of the whole motion below which a growing displacement does not mean that the machine integrates: three
# times the displacement that the test force causes on a spring which holds the mass in the dominant motion
HELD = 3.0 * PUSH
# share of the motion at the end of a record below which a phase shift by the test force is acceptable: twenty times
# the effect at rest, so that a force error of 1.5 %, usual in models of real machines, stays below 30 %
SAME_SWING_SHARE = 0.02
# share of the whole motion above which the run with the test force is unrelated to that without it: runs of a
# chaotic machine end 1.4 times the motion apart, and no further
PARTED = 0.5
WINDOW_PERIODS = 2.0  # periods of the dominant motion in a window
FEWEST_WINDOWS = 4  # windows per record
LEAST_BLOCKS = 24  # blocks in a window
MOST_WINDOWS = 200  # largest number of windows of all records; each costs a simulation


def _around(signal: PPoly | None, begin: float, end: float) -> PPoly | None:
    """The pieces of a signal that are needed between two times [s]."""
    if signal is None:
        return None
    first = max(int(np.searchsorted(signal.x, begin - MARGIN, side="right")) - 2, 0)
    last = min(int(np.searchsorted(signal.x, end + MARGIN)) + 1, len(signal.x) - 1)
    return PPoly(signal.c[:, first:last], signal.x[first : last + 1], extrapolate=True)


def split(series: Series, length: float) -> list[Series]:
    """Cut a series into windows of about `length` [s], each with an initial state of its own."""
    size = max(8 * series.block, round(length / series.period / series.block) * series.block)
    parts: list[Series] = []
    covered = (
        displacement(series) if series.measured == "velocity" else np.full(len(series.time), series.origin)
    )
    for first in range(0, len(series.time) - 4 * series.block, size):
        window = slice(first, min(first + size, len(series.time)))
        time = series.time[window]
        blocks = slice(first // series.block, first // series.block + (window.stop - first) // series.block)
        parts.append(
            replace(
                series, name=f"{record_of(series)}@{time[0]:.2f}s", record=record_of(series), time=time,
                value=series.value[window],
                used=series.used[blocks], spread=None if series.spread is None else series.spread[blocks],
                ignored=None if series.ignored is None else series.ignored[blocks],
                command=_around(series.command, time[0], time[-1]), forcing=_around(series.forcing, time[0], time[-1]),
                origin=float(covered[first]),
            )
        )  # fmt: skip
    return parts


def periods_long(series: Series) -> float:
    """Window length [s] of a few periods of the motion."""
    step = series.period * series.block
    length = max(WINDOW_PERIODS / dominant_frequency(series), LEAST_BLOCKS * step)
    return min(length, series.blocks * step / FEWEST_WINDOWS)


def windows(series: Sequence[Series], length: float) -> list[Series]:
    """All series cut into windows of about `length` [s]. A short remainder at the end of a series is left out. Of
    very many windows only every second, third, … is kept."""
    found: list[Series] = []
    for one in series:
        parts = split(one, length)
        found += [part for part in parts if part.blocks >= parts[0].blocks // 2]
    return found[:: max(1, math.ceil(len(found) / MOST_WINDOWS))]


def forgets(model: Model, series: Sequence[Series]) -> bool:
    """Whether the effect of a small constant force on the model levels off within the longest stretch of every record.

    A displacement that keeps growing means that the machine integrates or is unstable. Then the effect of every
    model error grows, too. The force also shifts the phase of a lightly damped oscillation a little more with every
    period. That is acceptable as long as the shifted oscillation differs little from the other.
    """
    series = longest_of_each(series)
    run = prepare_run(model, series, disturbed=True)
    for index, (one, start) in enumerate(zip(series, first_guess(model, run))):
        span = one.centres[-1] - one.centres[0]
        frequency = dominant_frequency(one)
        motion = float(np.std(one.averaged))
        scale = motion * model.mass.value * (2.0 * math.pi * frequency) ** 2
        push = first_order_hold(
            np.array([one.centres[0] - span, one.centres[-1] + span]), np.full(2, PUSH * scale)
        )
        free, pushed = run.rows(model, index, start), run.rows(model, index, start, push)
        if free is None or pushed is None:
            return False
        response = pushed[:, run.states] - free[:, run.states]
        n = len(response)
        length = min(max(n // 10, round(1.0 / (frequency * one.period * one.block))), n // 3)
        middle, end = response[n // 2 - length : n // 2], response[n - length :]
        displaced = abs(float(end.mean()))
        if displaced > GROWTH * abs(float(middle.mean())) and displaced > HELD * motion:
            return False
        differs, left = _rms(end), float(np.std(one.averaged[n - length :]))
        if differs > PARTED * motion or (
            differs > GROWTH * _rms(middle) and differs > SAME_SWING_SHARE * left
        ):
            return False
    return True


def _rms(samples: Array) -> float:
    return float(np.sqrt(np.mean(samples**2)))
