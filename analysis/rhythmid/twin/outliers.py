"""Outliers of a measurement as it comes in, left out by the criterion that the other commands use on records.

A sample is judged with those before it and a few after it, in chunks whose ends depend on the samples' times alone, so that the
result does not depend on how the samples arrive.
"""

import numpy as np
from numpy.typing import NDArray

from rhythmid.record.outlier import SAMPLES_OF_UNEVENNESS, WIDEST, outlying_samples
from rhythmid.twin.samples import Samples

Array = NDArray[np.float64]
CHUNK = 0.1  # [s] of samples judged together: half a segment
# earlier samples that tell how rough the signal usually is, and what share of it stands far off
BEFORE = 1000
AFTER = WIDEST + 2  # later samples: the end of the widest outlier, and two good samples beyond it


class WithoutOutliers:
    """A signal's samples without outliers; `left_out` counts these. An acceleration keeps them (`keep`): impacts cause such peaks."""

    def __init__(self, keep: bool = False) -> None:
        self.given = Samples()
        self.left_out = 0
        self._keep = keep
        self._taken = 0  # samples of the buffer that have been judged
        self._end = -np.inf  # [s] of the present chunk

    def take(self) -> tuple[Array, Array]:
        """Times [s] (n,) and values (n,) of the samples of all chunks that are complete; each sample is returned once."""
        given = self.given
        if self._keep:
            found = given.time, given.value
            given.time, given.value = np.empty(0), np.empty(0)
            return found
        if len(given) and self._end == -np.inf:
            self._end = float(given.time[0]) + CHUNK
        times, values = [np.empty(0)], [np.empty(0)]
        while True:
            last = int(np.searchsorted(given.time, self._end))
            until = max(last, SAMPLES_OF_UNEVENNESS) + AFTER
            if until > len(given):
                return np.concatenate(times), np.concatenate(values)
            since = max(0, min(self._taken, until - AFTER - BEFORE))
            away = outlying_samples(given.value[since:until])[self._taken - since : last - since]
            times.append(given.time[self._taken : last][~away])
            values.append(given.value[self._taken : last][~away])
            self.left_out += int(away.sum())
            self._taken = last
            self._end += CHUNK * max(1.0, np.ceil((given.time[last] - self._end) / CHUNK))
            self._forget()

    def _forget(self) -> None:
        first = max(0, self._taken - BEFORE)
        self.given.time, self.given.value = self.given.time[first:], self.given.value[first:]
        self._taken -= first
