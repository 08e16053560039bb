"""Figures of harmonic transfer functions: magnitude, phase, and how they change from one model to another."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rhythmid.report.blocks import Columns, Drawing, drawing
from rhythmid.report.chart import Chart, Curve
from rhythmid.report.quantity import number, pretty_unit, scaled

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]
FAINT_CHANGE = 2.0  # [% of the peak of |G_0|] below which a change is hardly visible
FAINT = 0.02  # share of the peak below which a phase has no meaning
STYLES = ("measured", "after", "before", "third")  # of |m| = 0, 1, 2, 3


@dataclass(frozen=True, eq=False)
class TransferFunction:
    """One harmonic transfer function: index `m`, frequency [Hz] and complex value (n,), `radius` (n,) of the disk about the
    value that holds the truth with 95 %, where known, and a model's value (n,) to compare with where there is one."""

    m: int
    frequency: Array
    value: Complex
    radius: Array | None = None
    model: Complex | None = None


def harmonic_name(m: int) -> str:
    """G₀, G₊₁, G₋₁, …"""
    sign = "₊" if m > 0 else "₋" if m < 0 else ""
    return f"G{sign}{str(abs(m)).translate(str.maketrans('0123456789', '₀₁₂₃₄₅₆₇₈₉'))}"


def style_of(m: int) -> str:
    return STYLES[min(abs(m), len(STYLES) - 1)]


def transfer_grid(functions: Sequence[TransferFunction], unit: str) -> Columns:
    """Magnitude and phase of each function, with 95 % bands and the model's curve."""
    figures: list[Drawing] = []
    for one in functions:
        name = harmonic_name(one.m)
        magnitude = np.abs(one.value)
        factor, label = scaled_ratio(float(magnitude.max(initial=0.0)), unit)
        band = one.radius
        low = None if band is None else factor * np.maximum(magnitude - band, 0.0)
        high = None if band is None else factor * (magnitude + band)
        curves = [Curve(one.frequency, factor * magnitude, "measured", "after", low=low, high=high)]
        if one.model is not None:
            curves.append(
                Curve(one.frequency, factor * np.abs(one.model), "fitted model", "before", dashed=True)
            )
        figures.append(
            drawing(
                f"|{name}|, magnitude",
                Chart(
                    f"Magnitude of {name} over frequency.",
                    "output frequency [Hz]",
                    f"magnitude [{label}]",
                    tuple(curves),
                    from_zero=True,
                    link=f"frequency of {name}",
                ),
                f"How strongly an input {_shift(one.m)}. Band: 95 %.",
            )
        )
        figures.append(_phase(one, name, band, magnitude))
    return Columns(tuple(figures))


def _shift(m: int) -> str:
    if m == 0:
        return "appears at its own frequency"
    side = "above" if m > 0 else "below"
    return f"appears {'once' if abs(m) == 1 else f'{abs(m)} times'} the pumping frequency {side} its own frequency"


def _phase(one: TransferFunction, name: str, band: Array | None, magnitude: Array) -> Drawing:
    strong = magnitude > FAINT * magnitude.max(initial=0.0)
    if band is not None:
        strong &= magnitude > band
    guide = one.value if one.model is None else one.model
    turns = np.degrees(np.unwrap(np.angle(guide)))
    # on the model's own turn, however noisy it is
    phase = turns + np.degrees(np.angle(one.value * guide.conj()))
    phase[~strong] = np.nan
    half = None if band is None else np.degrees(np.arctan2(band, np.maximum(magnitude, 1e-300)))
    curves = [
        Curve(
            one.frequency, phase, "measured", "after",
            low=None if half is None else phase - half, high=None if half is None else phase + half,
        )
    ]  # fmt: skip
    if one.model is not None:
        curves.append(Curve(one.frequency, turns, "fitted model", "before", dashed=True))
    return drawing(
        f"∠{name}, phase",
        Chart(
            f"Phase of {name} over frequency.", "output frequency [Hz]", "phase [degrees]", tuple(curves),
            link=f"frequency of {name}",
        ),
        "Its slope is the delay. Not drawn where the magnitude is below 2 % of its peak or less than its own interval.",
    )  # fmt: skip


def change_figures(
    frequency: Array,
    indices: Sequence[int],
    before: Complex | None,
    after: Complex,
    unit: str,
    pumping: float | None,
) -> Columns:
    """Effect of the missing physics on the transfer functions of a model.

    `before` (None where nothing was added) and `after` complex[h, n] of the harmonics `indices` (h,) at `frequency` [Hz] (n,).
    """
    top = np.abs(after)
    largest = float(top[list(indices).index(0)].max())
    factor, label = scaled_ratio(largest, unit)
    magnitudes = [
        Curve(frequency, factor * top[row], f"|{harmonic_name(m)}|", style_of(m), m < 0)
        for row, m in enumerate(indices)
        if abs(m) <= 1
    ]
    shifted = f" and shifted by the pumping of {pumping:.4g} Hz (G₊₁, G₋₁)" if pumping is not None else ""
    magnitude = drawing(
        "Transfer functions of the final model",
        Chart(
            "Magnitudes of the final model's harmonic transfer functions over frequency.",
            "output frequency [Hz]", f"magnitude [{label}]", tuple(magnitudes), from_zero=True,
        ),
        f"How the output answers a small input at its own frequency (G₀){shifted}.",
    )  # fmt: skip
    if before is None:
        return Columns((magnitude,))
    change = 100.0 * np.abs(after - before) / largest
    row, at = map(int, np.unravel_index(int(np.argmax(change)), change.shape))
    if change[row, at] < FAINT_CHANGE:
        words = "Small everywhere: small-signal transfer functions alone would hardly have shown the effect."
    else:
        place = f"{harmonic_name(indices[row])} near {number(float(frequency[at]), 2)} Hz"
        words = f"Largest in {place}: {number(float(change[row, at]), 2)} %."
    curves = [
        Curve(frequency, change[row], harmonic_name(m), style_of(m), m < 0) for row, m in enumerate(indices)
    ]
    changed = drawing(
        "What the effect changes in them",
        Chart(
            "Change of each harmonic transfer function from the refitted nominal model to the final model.",
            "output frequency [Hz]", "change [% of the peak of |G₀|]", tuple(curves), from_zero=True,
        ),
        f"Distance between the functions of the refitted nominal and the final model, delays included. {words}",
    )  # fmt: skip
    return Columns((magnitude, changed))


def scaled_ratio(largest: float, unit: str) -> tuple[float, str]:
    """Factor and printed unit for values of this size in `unit`, a ratio such as m/N."""
    above, _, below = unit.partition("/")
    factor, shown = scaled(largest, above)
    if not below:
        return factor, pretty_unit(shown)
    below = pretty_unit(below)
    return factor, f"{pretty_unit(shown)}/{f'({below})' if '·' in below else below}"
