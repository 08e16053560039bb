"""Figures of a record's motion and of the models' motion: over time, and in the plane of position and velocity."""

import math

import numpy as np
from numpy.typing import NDArray
from scipy.signal import savgol_filter

from rhythmid.report.blocks import Drawing, drawing
from rhythmid.report.chart import Chart, Curve
from rhythmid.report.quantity import pretty_unit, scaled
from rhythmid.report.run import Compared, Run, density

Array = NDArray[np.float64]
CYCLES = 6.0  # of the strongest line, that a phase portrait shows
SMOOTHED = 0.1  # of a cycle, over which a cubic is fitted for the velocity
FEWEST_IN_WINDOW = 7  # samples that such a cubic is fitted to at least


def time_link(run: Run) -> str:
    """Key of the charts of this record over time, which are zoomed together."""
    return f"time of {run.name}{' (held out)' if run.heldout else ''}"


def shaded(run: Run) -> tuple[tuple[float, float], ...]:
    """Held-out stretches of a record, as (from, to) [s]."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], run.hidden.astype(np.int8), [0]])))
    last = len(run.time) - 1
    return tuple((float(run.time[a]), float(run.time[min(b, last)])) for a, b in zip(edges[::2], edges[1::2]))


def over_time(run: Run, compared: Compared) -> Drawing:
    """Measured motion and that of the models."""
    factor, unit = scaled(float(np.ptp(run.measured)), compared.unit)
    curves = [
        Curve(run.time, factor * run.measured, "measured", "measured"),
        Curve(run.time, factor * run.before, run.labels[0], "before", dashed=True),
    ]
    if run.after is not None:
        curves.append(Curve(run.time, factor * run.after, run.labels[1], "after", dashed=True))
    hidden = shaded(run)
    role = "No fit has seen this record." if run.heldout else "Shaded: hidden from the fit." if hidden else ""
    return drawing(
        f"Measured and {compared.made}",
        Chart(
            f"{run.name}: the {compared.quantity} as measured and as {compared.made}, over time.",
            "time [s]", f"{compared.quantity} [{pretty_unit(unit)}]", tuple(curves), shaded=hidden, link=time_link(run),
        ),
        f"The {compared.quantity} of {run.name} and what each model makes of it. {role}".rstrip(),
        wide=True,
    )  # fmt: skip


def portrait(run: Run, compared: Compared) -> Drawing | None:
    """The last cycles in the plane of position and velocity, with the places where the model switches; None where what is
    compared is no motion, or the record too short."""
    if compared.quantity != "motion" or run.switches is None or not run.used.any():
        return None
    used = np.flatnonzero(run.used)
    frequency, amplitude = density(run, run.measured)
    cycle = 1.0 / (float(frequency[int(np.argmax(amplitude))]) * run.step)  # samples
    window = max(FEWEST_IN_WINDOW, 2 * math.ceil(0.5 * SMOOTHED * cycle) + 1)
    last = used[-1] + 1
    first = max(int(last - CYCLES * cycle), used[0])
    if last - first < 2 * window:
        return None
    factor, unit = scaled(float(np.ptp(run.measured)), compared.unit)

    def orbit(signal: Array, label: str, style: str, dashed: bool = True) -> Curve:
        piece = signal[first:last]
        x = np.asarray(savgol_filter(piece, window, 3))
        v = np.asarray(savgol_filter(piece, window, 3, deriv=1, delta=run.step))
        return Curve(factor * x, factor * v, label, style, dashed)

    curves = [
        orbit(run.measured, "measured", "measured", dashed=False),
        orbit(run.before, run.labels[0], "before"),
    ]
    if run.after is not None:
        curves.append(orbit(run.after, run.labels[1], "after"))
    low, high = float(np.min(run.measured[first:last])), float(np.max(run.measured[first:last]))
    places = [one for one in run.switches if one.signal == "x" and low <= one.value <= high]
    speeds = [one for one in run.switches if one.signal == "v"]
    names = ", ".join(dict.fromkeys(one.name for one in (*places, *speeds)))
    switching = f" Dotted: where the model switches ({names})." if names else ""
    return drawing(
        "Phase portrait",
        Chart(
            f"{run.name}: velocity over position, as measured and as {compared.made}.",
            f"position [{pretty_unit(unit)}]", f"velocity [{pretty_unit(f'{unit}/s')}]", tuple(curves), path=True,
            uprights=tuple(factor * value for value in sorted({one.value for one in places})),
            levels=tuple(factor * value for value in sorted({one.value for one in speeds})),
        ),
        f"Velocity over position in the last {CYCLES:.0f} cycles, both smoothed by a cubic polynomial over {100 * SMOOTHED:.0f} % of a cycle.{switching}",
    )  # fmt: skip
