"""Samples that do not say where the machine was: outliers, which a smooth signal cannot have taken, such as a bit that fell
over or a lost echo, and repeats, where a sensor is read more often than it measures or has stood still for a while."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import median_filter

from rhythmid.record.quality import clipped_samples
from rhythmid.record.rounding import resolution, resolutions

WIDEST = 3  # samples in a row that may be outliers
FAR_OFF = 12.0  # times the usual unevenness, from which a sample is suspected
# of its distance, that the slopes before and after may differ from the line past an outlier
PASSING = 0.25
SAMPLES_OF_UNEVENNESS = 101  # samples over which the usual unevenness is taken
LARGEST_SHARE = 0.02  # share of a signal beyond which such samples are no exception and belong to it
USUAL = 1.4826  # standard deviations in a median absolute deviation
LEAP = 1.5  # times the steps before and after, that the step out of repeats is at least: the motion went on meanwhile
OFTEN = 0.3  # share of repeats, from which a sensor may be read more often than it measures
FRESH = 2.5  # new values in a row between repeats, at most, where it is: two at a rate half as high again as its own
EVEN = 0.8  # share of runs of repeats that are of one length, within one, where it is
COUNTS = 3.0  # steps of the resolution that the usual change spans at least, where it is: a rounded value that creeps on changes by one

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]


def outlying_samples(value: Array) -> Mask:
    """Whether samples (n,) stand far off the line that the samples before and after them make, at most three in a row; of the two
    good ones on either side, the outer one may be missing at an end.

    A kink in the signal, such as an impact makes, changes the slope and is none; nor is what happens too often.
    """
    found = np.zeros(len(value), dtype=bool)
    if len(value) < SAMPLES_OF_UNEVENNESS:
        return found
    uneven = np.abs(value[1:-1] - 0.5 * (value[:-2] + value[2:]))
    usual = USUAL * np.maximum(median_filter(uneven, SAMPLES_OF_UNEVENNESS), np.median(uneven))
    limit = FAR_OFF * np.maximum(np.concatenate([usual[:1], usual, usual[-1:]]), resolutions(value))
    for width in range(1, WIDEST + 1):
        first = np.arange(1, len(value) - width)
        last = first + width
        slope = (value[last] - value[first - 1]) / (width + 1)
        off = np.stack([value[first + k] - value[first - 1] - slope * (k + 1) for k in range(width)])
        least = np.abs(off).min(axis=0)
        bent = np.zeros(len(first))
        bent[1:] = np.abs(value[first[1:] - 1] - value[first[1:] - 2] - slope[1:])
        bent[:-1] = np.maximum(bent[:-1], np.abs(value[last[:-1] + 1] - value[last[:-1]] - slope[:-1]))
        lone = (least > limit[first]) & (bent < PASSING * least)
        for k in range(width):
            found[first[lone] + k] = True
    return found if found.mean() <= LARGEST_SHARE else np.zeros(len(value), dtype=bool)


def repeated_samples(value: Array) -> Mask:
    """Whether samples (n,) repeat the one before though the motion went on.

    It did where the sensor is read more often than it measures, so that repeats come in even runs, and where they are an exception
    with a leap after them. A machine that sticks repeats values, too, but starts from rest, and one that does so often sticks and
    slips; where values are rounded, repeats say nothing unless what comes between them are leaps of many counts; and what is clipped
    is another matter. A sensor that is read too often measures a machine at rest again and again: of a longer run the samples are kept
    at which it did.
    """
    found = np.zeros(len(value), dtype=bool)
    step = np.diff(value)
    if len(value) < SAMPLES_OF_UNEVENNESS or not np.any(step == 0.0) or not np.any(step != 0.0):
        return found
    edges = np.diff(np.concatenate([[False], step == 0.0, [False]]).astype(int))
    # of steps of zero
    runs = list(zip(np.flatnonzero(edges == 1).tolist(), np.flatnonzero(edges == -1).tolist(), strict=True))
    lengths = np.array([end - begin for begin, end in runs])
    count = resolution(value)
    even = _read_often(step, lengths, count)
    share = lengths.sum() / len(step)
    for begin, end in runs:
        leap = count == 0.0 and share <= LARGEST_SHARE and _leaps(step, begin, end)
        if end < len(step) and (even or leap):
            found[begin + 1 : end + 1] = True
    if even:
        found[_measured_again(runs, round(float(np.median(lengths))) + 1)] = False
    return found & ~clipped_samples(value)


def _read_often(step: Array, lengths: NDArray[np.int64], count: float) -> bool:
    """Whether steps (n,) with runs of zeros of these lengths are those of a sensor that is read more often than it measures, in `count`s
    of its resolution (0: none)."""
    share = lengths.sum() / len(step)
    fresh = (len(step) - lengths.sum()) / len(lengths)  # values in a row that are new
    regular = np.mean(np.abs(lengths - np.median(lengths)) <= 1) > EVEN
    usual = float(np.median(np.abs(step[step != 0.0])))
    return bool(share > OFTEN and fresh < FRESH and regular and usual >= COUNTS * count)


def _measured_again(runs: Sequence[tuple[int, int]], every: int) -> list[int]:
    """Samples within runs of repeats at which a sensor that measures `every` so many samples has found the same once more."""
    return [
        begin + number * every for begin, end in runs for number in range(1, round((end + 1 - begin) / every))
    ]


def _leaps(step: Array, begin: int, end: int) -> bool:
    """Whether the step `end` after steps of zero from `begin` on is larger than the one before them and the one after it."""
    if begin == 0 or end + 1 >= len(step):
        return False
    return abs(step[end]) > LEAP * max(abs(step[begin - 1]), abs(step[end + 1]))
