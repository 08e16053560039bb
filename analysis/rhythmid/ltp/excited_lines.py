"""Assignment of a record's spectral bins to harmonics, and bins that contain only errors.

An input line at bin k causes a response in the bins k + mP, with P the bin of the pumping frequency. If the
excitation is designed so that at most one harmonic m reaches a bin, that harmonic can be read directly. Bins that
no harmonic reaches show noise and distortion. Products of an even number of lines fall on even multiples of the
lattice spanned by lines and pumping, products of an odd number on odd ones, if all lines are odd and P is even (R.
Pintelon, J. Schoukens, System Identification: A Frequency Domain Approach, 2nd ed., 2012, chapter 4; time-periodic:
E. Louarroudi et al., IEEE TIM 61(5), 2012). Shifted chirps are such a design: K chirps of period (n + 1/K) T put
harmonic m into the bins m mod K.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from rhythmid.ltp.spectra import Spectra

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
STRONG = 0.3  # share of the typical line above which a line is used for an estimate
LIVE = 1e-3  # share of the typical line below which a line is taken as zero
FARTHEST = 12  # harmonics on either side that may reach a bin


@dataclass(frozen=True, eq=False)
class ExcitedLines:
    """The lines of one record. Masks are over the bins 0 … L of its spectra."""

    spectra: Spectra
    live: Mask
    strong: Mask

    @property
    def periods(self) -> int:
        """P, the bin of the pumping frequency; 0 without pumping."""
        return self.spectra.window.periods if self.spectra.pumping.active else 0

    @property
    def farthest(self) -> int:
        """Number of harmonics on either side that are considered."""
        return FARTHEST if self.periods else 0

    def reaching(self, m: int, lines: Mask) -> Mask:
        """Bins to which harmonic m brings one of the `lines`."""
        source = np.abs(np.arange(len(lines)) - m * self.periods)
        inside = source < len(lines)
        return np.where(inside, lines[np.where(inside, source, 0)], False)

    @cached_property
    def within(self) -> Mask:
        """Bins that are used: above zero, up to the highest that a strong line and the first sideband reach, and
        without those of the limit cycle."""
        bins = np.arange(len(self.live))
        last = int(np.flatnonzero(self.strong)[-1]) + self.periods
        inside = (bins > 0) & (bins <= last)
        return inside & (bins % self.periods != 0) if self.periods else inside

    def alone(self, m: int, harmonics: int) -> Mask:
        """Bins with a strong line that only m reaches, among the harmonics up to ±`harmonics`."""
        found = self.reaching(m, self.strong) & self.within
        for n in range(-harmonics, harmonics + 1):
            if n != m:
                found &= ~self.reaching(n, self.live)
        return found

    def separation(self, harmonics: int) -> float:
        """Smallest share, over the harmonics up to ±`harmonics`, of bins reached that are reached alone."""
        shares = []
        for m in range(-harmonics, harmonics + 1):
            reached = self.reaching(m, self.strong) & self.within
            shares.append(float(self.alone(m, harmonics).sum()) / max(1, int(reached.sum())))
        return min(shares)

    @cached_property
    def lattice(self) -> int:
        """Greatest common divisor of lines and pumping: products of lines fall only on its multiples."""
        return int(np.gcd.reduce(np.append(np.flatnonzero(self.strong), self.periods)))

    @cached_property
    def quiet(self) -> Mask:
        """Bins that not even distortion reaches, because the excitation repeats within the record."""
        return self.within & (np.arange(len(self.live)) % self.lattice != 0) & ~self.live

    def empty(self, harmonics: int) -> Mask:
        """Bins of the lattice that no harmonic up to ±`harmonics` reaches."""
        taken = np.any([self.reaching(n, self.live) for n in range(-harmonics, harmonics + 1)], axis=0)
        return self.within & ~taken & ~self.quiet

    @cached_property
    def linear(self) -> Mask:
        """Bins that any harmonic reaches."""
        return np.any([self.reaching(n, self.live) for n in range(-self.farthest, self.farthest + 1)], axis=0)

    @cached_property
    def parity(self) -> NDArray[np.int64] | None:
        """0 for bins of even-order distortion, 1 for odd; None where the excitation mixes them."""
        step = self.lattice
        lines = np.flatnonzero(self.strong) // step
        if np.any(lines % 2 == 0) or (self.periods // step) % 2 == 1:
            return None
        return (np.arange(len(self.live)) // step) % 2

    @cached_property
    def classes(self) -> NDArray[np.int64]:
        """Residue class of each bin modulo the lines' spacing; bins of one class coincide in a comb."""
        lines = np.flatnonzero(self.strong)
        spacing = int(np.gcd.reduce(np.diff(lines))) if len(lines) > 1 else 1
        return np.arange(len(self.live)) % max(1, spacing)


def excited_lines(spectra: Spectra) -> ExcitedLines:
    """The lines of a record's input. Raises InputError when the input has no power."""
    low, high = spectra.band
    size = np.abs(spectra.input)
    band = (spectra.frequency >= low) & (spectra.frequency <= high)
    found = size[band]
    lines = found[found > LIVE * found.max()]
    typical = float(np.median(lines[lines > STRONG * lines.max()]))
    strong = (size > STRONG * typical) & band
    strong[0] = False
    return ExcitedLines(spectra, size > LIVE * typical, strong)
