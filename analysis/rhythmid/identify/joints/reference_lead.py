"""By how much the reference in a recorded effort is ahead of the one that acts, where it is held between its stamps.

A drive that reports its effort at the instant at which a new reference has come tells k_p (r - x) - k_d v of that instant, although on
average over the period T an older reference acts: by T/2, less the half of a controller's own step. One that reports just before is late by
as much. This is so of the part of the reference alone, so no alignment of effort and motion puts it right: in a balance it is k_p T/2 of
damping and k_d T/2 of inertia. An effort that is the mean over T is right, and so is on average one that is not in step with the reference.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rhythmid.record.record import Channel

Array = NDArray[np.float64]
IN_STEP = 0.9  # length of the mean unit vector of the phases: stamps that scatter by up to 7 % of the period
TAKEN_TOGETHER_SHARE = (
    0.1  # of the period before a stamp of the reference, within which an effort counts as taken with it
)


@dataclass(frozen=True, eq=False)
class HeldReference:
    """A reference (n,) on straight lines between its stamps, and its period [s]."""

    between: Array
    period: float

    def moved(self, time: Array, lead: float) -> Array:
        """By how much the reference at `time` (n,) [s] is more where it is later by the lead."""
        return np.interp(time - lead, time, self.between) - self.between


def held_reference(effort: Channel, reference: Channel, grid: Array) -> HeldReference | None:
    """The reference at the times of a grid (n,), none where efforts are not taken in step with it."""
    last = (
        np.searchsorted(reference.time, effort.time + TAKEN_TOGETHER_SHARE * reference.period, side="right")
        - 1
    )
    phases = (effort.time[last >= 0] - reference.time[last[last >= 0]]) / reference.period
    if len(phases) == 0 or abs(complex(np.mean(np.exp(2j * np.pi * phases)))) < IN_STEP:
        return None
    return HeldReference(np.interp(grid, reference.time, reference.value), reference.period)


def told_of(leads: Mapping[str, float]) -> Iterator[str]:
    """What is to be known of efforts that were changed by these leads [s]."""
    if leads:
        most = 1e3 * max(leads.values(), key=abs)
        where = "ahead of" if most > 0.0 else "behind"
        yield (
            f"the efforts of {', '.join(leads)} are taken to have been recorded at the instants of references that are held: these are "
            f"{abs(most):.2g} ms {where} what acts, which is allowed for; say what they are with sampled: mean or instant under 'effort:'"
        )
