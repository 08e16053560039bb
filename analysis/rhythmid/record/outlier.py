"""Samples that do not show the machine's position: outliers and repeats.

An outlier is a value that a smooth signal cannot have taken, such as a flipped bit or a lost echo. Repeats come
from a sensor that is read more often than it measures, or that was stuck for a while.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import median_filter

from rhythmid.record.quality import clipped_samples
from rhythmid.record.rounding import least_step, resolution, resolutions

WIDEST = 3  # largest number of consecutive outliers
FAR_OFF = 12.0  # ratio to the usual roughness above which a sample is suspected
# largest deviation of the slopes before and after from the line across an outlier, as a share of its distance
PASSING = 0.25
SAMPLES_OF_UNEVENNESS = 101  # samples over which the usual roughness is measured
LARGEST_SHARE = 0.02  # share of a signal above which such samples are not exceptional and are part of it
USUAL = 1.4826  # ratio of standard deviation to median absolute deviation
# least ratio of the step after repeats to the steps before and after: the motion went on meanwhile
LEAP = 1.5
OFTEN = 0.3  # share of repeats above which a sensor may be read more often than it measures
# most consecutive new values between repeats for such a sensor: two if it is read at one and a half times its rate
FRESH = 2.5
EVEN = 0.8  # least share of runs of repeats with one length, within one sample, for such a sensor
# least usual change in steps of the resolution for such a sensor: a slowly changing rounded value changes by one
COUNTS = 3.0

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]


def outlying_samples(value: Array) -> Mask:
    """Whether samples (n,) are far from the line through the samples before and after them, for at most three in a row.

    Two good samples are needed on either side; at an end of the record the outer one may be missing. A kink in the
    signal, such as an impact, changes the slope and is no outlier. Values that occur too often are none, either.
    """
    found = np.zeros(len(value), dtype=bool)
    if len(value) < SAMPLES_OF_UNEVENNESS:
        return found
    uneven = np.abs(value[1:-1] - 0.5 * (value[:-2] + value[2:]))
    usual = USUAL * np.maximum(median_filter(uneven, SAMPLES_OF_UNEVENNESS), np.median(uneven))
    rounded = np.maximum(resolutions(value), least_step(value))
    limit = FAR_OFF * np.maximum(np.concatenate([usual[:1], usual, usual[-1:]]), rounded)
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
    """Whether samples (n,) repeat the one before although the motion continued.

    There are two cases. A sensor that is read more often than it measures gives even runs of repeats. Otherwise
    repeats are an exception with a leap after them. Three other causes are excluded. A machine that sticks also
    repeats values, but starts from rest; frequent repeats of that kind are stick-slip. With rounded values, repeats
    count only if the changes between them are leaps of many steps. Clipped samples are handled separately. A sensor
    that is read too often measures a machine at rest repeatedly: of a longer run, the samples at its own
    measurement times are kept.
    at which it did.
    """
    found = np.zeros(len(value), dtype=bool)
    step = np.diff(value)
    if len(value) < SAMPLES_OF_UNEVENNESS or not np.any(step == 0.0) or not np.any(step != 0.0):
        return found
    edges = np.diff(np.concatenate([[False], step == 0.0, [False]]).astype(int))
    # for zero steps
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
    """Whether steps (n,), with runs of zeros of these lengths, come from a sensor that is read more often than it
    measures. `count` is its resolution (0: none)."""
    share = lengths.sum() / len(step)
    fresh = (len(step) - lengths.sum()) / len(lengths)  # consecutive new values
    regular = np.mean(np.abs(lengths - np.median(lengths)) <= 1) > EVEN
    usual = float(np.median(np.abs(step[step != 0.0])))
    return bool(share > OFTEN and fresh < FRESH and regular and usual >= COUNTS * count)


def _measured_again(runs: Sequence[tuple[int, int]], every: int) -> list[int]:
    """Samples within runs of repeats at which a sensor that measures every `every` samples has measured the same
    value again."""
    return [
        begin + number * every for begin, end in runs for number in range(1, round((end + 1 - begin) / every))
    ]


def _leaps(step: Array, begin: int, end: int) -> bool:
    """Whether the step `end`, after zero steps from `begin` on, is larger than the steps before and after them."""
    if begin == 0 or end + 1 >= len(step):
        return False
    return abs(step[end]) > LEAP * max(abs(step[begin - 1]), abs(step[end + 1]))
