"""Multisines: sums of harmonics of 1/period, repeated. Every line is known exactly, so that noise shows between the lines.

R. Pintelon, J. Schoukens, System Identification: A Frequency Domain Approach, 2nd ed., Wiley 2012, chapter 2.
"""

import math
from typing import Annotated, Literal

import numpy as np
from pydantic import Field, model_validator
from scipy.fft import next_fast_len

from rhythmid.errors import InputError
from rhythmid.excitation.excitation import Array, Excitation

FINENESS = 64  # samples in the shortest period, for finding the peak; it is missed by a thousandth at most (1 - cos(pi/64))


class Multisine(Excitation):
    """u(t) = Σ_k a_k cos(2π k t / period + φ_k).

    Lines are given explicitly (`lines`, with optional relative `weights` and `phases` [rad]) or chosen from `band`. They are
    all lines of the band; only the odd ones (even distortion then shows on even lines); or, with a `pumping` frequency, one
    residue class (k mod P) = `residue`, so that every sideband of a line falls into a class of its own. `rms` [N] sets the size.
    `part` [i, n] keeps the i-th of the chosen lines and every n-th after it: n such signals are orthogonal over a period.
    """

    type: Literal["multisine"] = "multisine"
    rms: Annotated[float, Field(ge=0)]
    period: Annotated[float, Field(gt=0)] = 10.0
    periods: Annotated[int, Field(ge=1)] = 3
    band: tuple[Annotated[float, Field(ge=0)], Annotated[float, Field(ge=0)]] = (0.1, 7.0)
    select: Literal["all", "odd", "residue"] = "odd"
    pumping: Annotated[float, Field(gt=0)] = 1.0
    residue: Annotated[int, Field(ge=0)] = 1
    part: tuple[Annotated[int, Field(ge=0)], Annotated[int, Field(ge=1)]] = (0, 1)
    lines: tuple[Annotated[int, Field(ge=1)], ...] = ()
    weights: tuple[float, ...] = ()
    phases: tuple[float, ...] = ()
    seed: int = 0
    start_delay: Annotated[float, Field(ge=0)] = 0.0

    @model_validator(mode="after")
    def _lists_match(self) -> "Multisine":
        for name in ("weights", "phases"):
            given = getattr(self, name)
            if given and len(given) != len(self.lines):
                raise ValueError(f"{name}: {len(given)} values for {len(self.lines)} lines")
        if len(self.harmonics) == 0:
            raise ValueError(
                "band: no line of the multisine falls into it; make the period longer or the band wider"
            )
        return self

    @property
    def harmonics(self) -> np.ndarray:
        """Excited multiples k of 1/period."""
        if self.lines:
            return np.array(self.lines)
        low, high = sorted(self.band)
        k = np.arange(max(1, math.ceil(low * self.period - 1e-9)), math.floor(high * self.period + 1e-9) + 1)
        if self.select == "odd":
            k = k[k % 2 == 1]
        if self.select == "residue":
            classes = self.pumping * self.period
            if abs(classes - round(classes)) > 1e-6:
                raise InputError("multisine: with select residue the period must hold whole pumping periods")
            k = k[k % round(classes) == self.residue % round(classes)]
        first, step = self.part
        return k[first % step :: step]

    @property
    def duration(self) -> float:
        return self.start_delay + self.period * self.periods

    def _lines(self) -> tuple[np.ndarray, Array, Array]:
        """Multiples k of 1/period, amplitudes and phases of the lines, (n,) each."""
        k = self.harmonics
        weight = np.array(self.weights) if self.weights else np.ones(len(k))
        phase = (
            np.array(self.phases)
            if self.phases
            else np.random.default_rng(self.seed).uniform(0, 2 * np.pi, len(k))
        )
        return k, self.rms * math.sqrt(2.0) * weight / np.linalg.norm(weight), phase

    @property
    def peak(self) -> float:
        """Largest |u| [N] of a period, found by a Fourier transform because a long period has thousands of lines."""
        k, amplitude, phase = self._lines()
        least = FINENESS * int(k.max())
        count = next_fast_len(least, real=True) or least
        spectrum = np.zeros(count // 2 + 1, dtype=complex)
        np.add.at(spectrum, k, 0.5 * count * amplitude * np.exp(1j * phase))
        return float(np.abs(np.fft.irfft(spectrum, count)).max())

    def shape(self, time: Array) -> Array:
        k, amplitude, phase = self._lines()
        t = np.asarray(time) - self.start_delay
        value = np.zeros(len(t))
        for number, size, angle in zip(k, amplitude, phase):
            value += size * np.cos(2 * np.pi * number * t / self.period + angle)
        return np.where(t >= 0.0, value, 0.0)
