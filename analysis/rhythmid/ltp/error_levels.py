"""Error levels of transfer functions from a record's empty bins: noise, distortion, higher harmonics."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rhythmid.ltp.excited_lines import ExcitedLines

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
FEW, MANY = 12, 60  # empty bins over which a level is averaged: a level that varies with frequency, and noise
CLEAR = 2.0  # standard deviations by which a level must exceed another one


@dataclass(frozen=True, eq=False)
class Level:
    """Mean power |Y|² of an error in each bin [unit² s²], (L + 1,), and the number of bins in each average."""

    power: Array
    freedom: Array


def local_level(power: Array, where: Mask, count: int) -> Level:
    """Mean of `power` over the `count` bins `where` that are nearest to each bin; NaN where there are none at all."""
    places = np.flatnonzero(where)
    if len(places) == 0:
        return Level(np.full(len(power), np.nan), np.zeros(len(power)))
    count = min(count, len(places))
    sums = np.concatenate([[0.0], np.cumsum(power[places])])
    means = (sums[count:] - sums[:-count]) / count
    first = np.searchsorted(places, np.arange(len(power))) - count // 2
    return Level(means[np.clip(first, 0, len(places) - count)], np.full(len(power), float(count)))


@dataclass(frozen=True, eq=False)
class ErrorLevels:
    """Levels measured in empty bins: noise, distortion of even and odd order (NaN where they cannot be separated), and
    `higher`, the squared size of HTFs beyond those estimated [(output unit / input unit)²]."""

    noise: Level
    even: Array
    odd: Array
    higher: Array


def error_levels(lines: ExcitedLines, harmonics: int) -> ErrorLevels:
    """Levels of noise, distortion and higher harmonics when −M … M (`harmonics`) are estimated."""
    power = np.abs(lines.spectra.output) ** 2
    empty = lines.empty(harmonics)
    parity, products = lines.parity, empty & ~lines.linear
    kinds: list[Mask] = []
    if parity is not None:
        kinds = [products & (parity == 0), products & (parity == 1)]
    if lines.quiet.sum() >= MANY:
        noise = local_level(power, lines.quiet, MANY)
    else:
        groups = kinds if kinds else _classes(lines, empty)
        levels = [local_level(power, group, MANY) for group in groups if group.sum() >= FEW]
        noise = _least(levels or [local_level(power, empty, MANY)])
    unknown = np.full(len(power), np.nan)
    even, odd = (
        _excess(local_level(power, kind, MANY), noise) if kind.sum() >= FEW else unknown
        for kind in kinds or (empty & False,) * 2
    )
    return ErrorLevels(noise, even, odd, _higher(lines, harmonics, power, empty, noise))


def _classes(lines: ExcitedLines, empty: Mask) -> list[Mask]:
    """Empty bins by residue class; in a comb, by the higher harmonics that reach them."""
    present = np.unique(lines.classes[empty])
    return [empty & (lines.classes == one) for one in present] if len(present) <= 32 else [empty]


def _least(levels: Sequence[Level]) -> Level:
    """The smallest level in each bin, pooled with those that do not exceed it significantly."""
    power, freedom = np.array([one.power for one in levels]), np.array([one.freedom for one in levels])
    least = power.min(axis=0)
    alike = power <= (1.0 + CLEAR * np.sqrt(2.0 / np.maximum(freedom, 1.0))) * least
    count = np.sum(freedom * alike, axis=0)
    return Level(np.sum(power * freedom * alike, axis=0) / np.maximum(count, 1.0), count)


def _excess(level: Level, noise: Level) -> Array:
    """Power above the noise, where it exceeds the scatter of both averages."""
    scatter = np.sqrt(1.0 / np.maximum(level.freedom, 1.0) + 1.0 / np.maximum(noise.freedom, 1.0))
    return np.where(level.power > (1.0 + CLEAR * scatter) * noise.power, level.power - noise.power, 0.0)


def _higher(lines: ExcitedLines, harmonics: int, power: Array, empty: Mask, noise: Level) -> Array:
    """Mean square of HTFs beyond ±M, from bins that only these reach."""
    source = power_beyond(lines, harmonics)
    seen = empty & (source > 0.0)
    above = _excess(local_level(power, seen, FEW), noise)
    return np.nan_to_num(above / local_level(source, seen, FEW).power)


def power_beyond(lines: ExcitedLines, harmonics: int) -> Array:
    """Σ |U_{l−nP}|² over the strong lines that harmonics |n| > M bring to each bin [unit² s²]."""
    size = np.where(lines.strong, np.abs(lines.spectra.input) ** 2, 0.0)
    bins = np.arange(len(size))
    total = np.zeros(len(size))
    for n in range(harmonics + 1, lines.farthest + 1):
        for signed in (-n, n):
            source = np.abs(bins - signed * lines.periods)
            inside = source < len(size)
            total[inside] += size[source[inside]]
    return total
