"""Figures of harmonic transfer functions in the manner of the paper's Figures 2 and 3, as PNG files."""

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from rhythmid.errors import InputError

DOTS = 150  # points of an estimate that are drawn
STYLES: dict[str, dict[str, Any]] = {
    "theory": {"color": "tab:red", "linestyle": "-"},
    "estimate": {"color": "black", "linestyle": "none", "marker": ".", "markersize": 3},
    "parametric fit": {"color": "tab:blue", "linestyle": "--"},
    "compensated": {"color": "tab:green", "linestyle": "none", "marker": ".", "markersize": 3},
}


@dataclass(frozen=True, eq=False)
class Curve:
    """One HTF to draw: `kind` theory, estimate, parametric fit or compensated; frequency [Hz] (n,), value (n,)."""

    kind: str
    frequency: NDArray[np.float64]
    value: NDArray[np.complex128]


Panels = Mapping[int, Sequence[Curve]]


def save_figure(figure: Figure, path: Path) -> None:
    """Write a PNG completely or not at all. Raises InputError if the place is not writable."""
    partial = path.with_name(f".{path.name}.partial")
    try:
        figure.savefig(partial, format="png", dpi=130)
        os.replace(partial, path)
    except OSError as error:
        raise InputError(f"{path}: the figure cannot be written: {error.strerror}") from None


def _panels(panels: Panels, title: str) -> tuple[Figure, dict[int, Axes]]:
    figure = Figure(figsize=(4.0 * len(panels), 3.4), layout="constrained")
    figure.suptitle(title)
    axes = figure.subplots(1, len(panels), squeeze=False)[0]
    for axis, m in zip(axes, panels):
        axis.set_title(f"$G_{{{m}}}(j\\omega)$")
        axis.set_xlabel("output frequency [Hz]")
        axis.grid(alpha=0.3)
    return figure, dict(zip(panels, axes))


def _draw(axis: Axes, curve: Curve, value: NDArray[np.float64]) -> None:
    dotted = STYLES[curve.kind]["linestyle"] == "none"
    thin = max(1, len(value) // DOTS) if dotted else 1
    axis.plot(curve.frequency[::thin], value[::thin], label=curve.kind, **STYLES[curve.kind])


def magnitude_figure(panels: Panels, unit: str = "m/N") -> Figure:
    """Magnitudes of HTFs, a panel for each harmonic: the paper's Figure 2."""
    figure, axes = _panels(panels, "Magnitude of the harmonic transfer functions")
    for m, axis in axes.items():
        for curve in panels[m]:
            _draw(axis, curve, np.abs(curve.value))
        axis.set_ylim(bottom=0.0)
    first = next(iter(axes.values()))
    first.set_ylabel(f"magnitude [{unit}]")
    first.legend()
    return figure


def phase_figure(panels: Panels) -> Figure:
    """Phases of HTFs, a panel for each harmonic: the paper's Figure 3. Curves should lie on the model's once compensated."""
    figure, axes = _panels(panels, "Phase of the harmonic transfer functions")
    for m, axis in axes.items():
        for curve in panels[m]:
            value = np.angle(curve.value)
            # a line must not cross the plot where the phase wraps
            if STYLES[curve.kind]["linestyle"] != "none":
                value[1:][np.abs(np.diff(value)) > np.pi] = np.nan
            _draw(axis, curve, value)
        axis.set_ylim(-np.pi, np.pi)
        axis.set_yticks([-np.pi, 0.0, np.pi], ["−π", "0", "π"])
    first = next(iter(axes.values()))
    first.set_ylabel("phase [rad]")
    first.legend()
    return figure
