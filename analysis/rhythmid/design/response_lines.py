"""Bins of the responses to the lines of a command, and whether any two of them coincide.

A machine pumped at ω_p responds to a line at ω with lines at ω + mω_p, and at the mirror images −ω + mω_p. Over a window of P
pumping periods these are the bins |l + mP|. Harmonic transfer functions can be read off line by line only where all of
them differ, and differ from the limit cycle's own bins nP (E. Louarroudi et al., IEEE TIM 61(5), 2012).
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rhythmid.errors import InputError

Lines = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class ResponseLines:
    """Excited bins of a command and the bins of its responses.

    `lines` (n,) are bins of width `resolution` [Hz] in a window of `periods` P pumping periods; responses up to the harmonic M
    must not coincide.
    """

    lines: Lines
    periods: int
    resolution: float
    harmonics: int

    @property
    def frequency(self) -> NDArray[np.float64]:
        """Excited frequencies [Hz] (n,)."""
        return self.lines.astype(np.float64) * self.resolution

    @property
    def orders(self) -> Lines:
        """−M … M."""
        return np.arange(-self.harmonics, self.harmonics + 1)

    @property
    def bins(self) -> Lines:
        """Bins of the responses |l + mP|, shape (2M + 1, n)."""
        return np.abs(self.lines[None, :] + self.orders[:, None] * self.periods)

    @property
    def separate(self) -> bool:
        """Whether every response has a bin of its own."""
        bins = self.bins
        return len(np.unique(bins)) == bins.size and not np.any(bins % self.periods == 0)

    def require_separate(self, remedy: str) -> None:
        """Raise InputError naming two responses that coincide, and the `remedy`."""
        if self.separate:
            return
        bins = self.bins
        hidden = np.flatnonzero(np.any(bins % self.periods == 0, axis=0))
        if len(hidden):
            raise InputError(
                f"the design aliases: the line at {self.frequency[hidden[0]]:.6g} Hz lies on a harmonic of the forcing, where "
                f"the limit cycle hides its response; {remedy}"
            )
        # with few harmonics between them the example is the clearest
        for nearest in range(1, self.harmonics + 1):
            rows = np.flatnonzero(np.abs(self.orders) <= nearest)
            order = np.argsort(bins[rows], axis=None, kind="stable")
            same = np.flatnonzero(np.diff(bins[rows].ravel()[order]) == 0)
            if len(same):
                (first, n), (second, k) = (
                    divmod(int(order[same[0] + step]), len(self.lines)) for step in (0, 1)
                )
                raise InputError(
                    f"the design aliases: the responses to {self.frequency[n]:.6g} Hz at m = {_signed(first - nearest)} and to "
                    f"{self.frequency[k]:.6g} Hz at m = {_signed(second - nearest)} both fall on "
                    f"{bins[rows[first], n] * self.resolution:.6g} Hz; {remedy}"
                )


def _signed(m: int) -> str:
    return f"{m:+d}" if m else "0"
