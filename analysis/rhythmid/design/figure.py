"""The figure of a design: the command, the motion, and both spectra with the harmonics of the forcing."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from rhythmid.design.designer import Design

Array = NDArray[np.float64]
# periods of the forcing, or of the middle of the band without forcing, over which the motion is drawn
SHOWN_PERIODS = 4
# periods of the highest frequency over which the command is drawn; more could not be distinguished
CYCLES = 60
COLOURS = {0: "black", 1: "tab:blue", 2: "tab:green", 3: "tab:orange", 4: "tab:red"}
DEEPEST = 1e-2  # share of the noise floor below which nothing is drawn


def _over_window(design: Design, signal: Array) -> Array:
    """Amplitude spectrum over the window at the run's end, at bins 0, 1, …"""
    step = 1.0 / design.requirements.rate
    time = np.arange(len(signal)) * step
    count = round(design.plan.window / step)
    grid = design.plan.lead_in + np.arange(count) * (design.plan.window / count)
    return np.abs(np.fft.rfft(np.interp(grid, time, signal))) * 2.0 / count


def _harmonics(axis: Axes, design: Design) -> None:
    """Vertical lines at the harmonics of the forcing, if any; the axis ends at the last response."""
    wanted = design.requirements
    top = wanted.band[1] + wanted.harmonics * wanted.grid
    axis.set_xlim(0.0, top)
    axis.set_xlabel(f"frequency [Hz]{'; red: harmonics of the forcing' if wanted.forced else ''}")
    if not wanted.forced:
        return
    for n in range(1, int(top / wanted.grid) + 1):
        axis.axvline(n * wanted.grid, color="tab:red", alpha=0.25, linewidth=0.8)


def draw_command(axis: Axes, design: Design) -> None:
    """The command over one repetition, or a part of it if it is long, with its limits."""
    first = round(design.plan.lead_in * design.requirements.rate)
    length = min(design.plan.repeat, CYCLES / design.requirements.band[1])
    shown = slice(first, first + round(length * design.requirements.rate))
    time = np.arange(len(design.command.values)) / design.requirements.rate
    axis.plot(time[shown], design.command.values[shown], linewidth=0.8, color="tab:blue")
    limit = design.requirements.max_effort
    axis.axhline(limit, color="tab:red", linestyle="--", linewidth=0.8, label="largest effort")
    axis.axhline(-limit, color="tab:red", linestyle="--", linewidth=0.8)
    axis.set_title(
        f"command, repeats after {design.plan.repeat:.6g} s, crest factor {design.command.crest_factor:.2f}"
    )
    axis.set_ylim(-1.1 * limit, 1.4 * limit)
    axis.set_xlabel("time [s]")
    axis.set_ylabel(f"u [{design.experiment.model.units.force}]")
    axis.legend(loc="upper right")


def _motion(axis: Axes, design: Design) -> None:
    wanted, rate = design.requirements, design.requirements.rate
    far = int(np.argmax(np.abs(design.output - np.median(design.output))))
    half = round(0.5 * SHOWN_PERIODS / (wanted.grid if wanted.forced else 0.5 * sum(wanted.band)) * rate)
    first = int(np.clip(far - half, 0, max(0, len(design.output) - 2 * half)))
    shown = slice(first, first + 2 * half)
    time = np.arange(len(design.output)) / rate
    axis.plot(
        time[shown],
        design.still[shown],
        color="0.6",
        label="limit cycle" if wanted.forced else "without command",
    )
    axis.plot(time[shown], design.output[shown], color="tab:blue", linewidth=1.0, label="with command")
    reach = design.amplitude.high - design.amplitude.low
    for end in design.requirements.envelope:
        if design.amplitude.low - reach < end < design.amplitude.high + reach:
            axis.axhline(end, color="tab:red", linestyle="--", linewidth=0.8, label="envelope")
    handles, labels = axis.get_legend_handles_labels()
    one_each = dict(zip(labels, handles))
    axis.legend(one_each.values(), one_each.keys(), loc="upper right")
    axis.set_title("measured position about its extreme, noise left out")
    axis.set_xlabel("time [s]")
    axis.set_ylabel(f"y [{design.experiment.model.units.position}]")


def _command_spectrum(axis: Axes, design: Design, spectrum: Array) -> None:
    lines = design.plan.response
    axis.vlines(lines.frequency, 0.0, spectrum[lines.lines], color="tab:blue", linewidth=0.9)
    left_out = design.plan.facts.get("left_out", [])
    if left_out:
        axis.plot(
            left_out,
            np.zeros(len(left_out)),
            "x",
            color="black",
            markersize=4,
            label="left out, shows odd distortion",
        )
        axis.legend(loc="upper right")
    _harmonics(axis, design)
    top = float(spectrum[lines.lines].max())
    axis.set_ylim(-0.03 * top, 1.25 * top)
    axis.set_title(f"spectrum of the command: {len(lines.lines)} lines")
    axis.set_ylabel(f"|U| [{design.experiment.model.units.force}]")


def _response_spectrum(axis: Axes, design: Design, spectrum: Array) -> None:
    lines = design.plan.response
    floor = 2.0 * design.requirements.noise_std / np.sqrt(design.plan.window * design.requirements.rate)
    simulated = _over_window(design, design.output - design.still)
    own = np.unique(lines.bins)
    rest = np.setdiff1d(np.arange(1, min(len(simulated), int(own.max()) + 1)), own)
    axis.semilogy(
        rest * lines.resolution,
        simulated[rest],
        ".",
        markersize=1.5,
        color="0.6",
        label="between the lines: distortion",
    )
    for m in range(lines.harmonics + 1):
        for sign in (1,) if m == 0 else (1, -1):
            out = (lines.lines + sign * m * lines.periods).astype(np.float64) * lines.resolution
            size = np.abs(design.machine.htf(np.array([sign * m]), out)[0]) * spectrum[lines.lines]
            name = f"m = {'±' if m else ''}{m}" if sign > 0 else None
            axis.semilogy(
                np.abs(out), size, ".", markersize=3, color=COLOURS.get(m, "tab:purple"), label=name
            )
    axis.axhline(floor, color="tab:red", linestyle="--", linewidth=0.8, label="noise")
    _harmonics(axis, design)
    axis.set_ylim(DEEPEST * floor, 30.0 * axis.get_ylim()[1])
    axis.set_title("predicted response")
    axis.set_ylabel(f"|Y| [{design.experiment.model.units.position}]")
    axis.legend(loc="upper right", ncols=2, fontsize="small")


def design_figure(design: Design) -> Figure:
    """Command and motion over time, and the spectra of command and response."""
    figure = Figure(figsize=(13.0, 8.0), layout="constrained")
    (one, two), (three, four) = figure.subplots(2, 2)
    spectrum = _over_window(design, design.command.values)
    draw_command(one, design)
    _motion(two, design)
    _command_spectrum(three, design, spectrum)
    _response_spectrum(four, design, spectrum)
    return figure
