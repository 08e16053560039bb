"""Lead of the reference in a recorded effort over the acting reference, where references are held between timestamps.

Suppose a drive reports its effort at the instant at which a new reference arrives. It then reports k_p (r - x) -
k_d v of that instant. On average over the period T an older reference acts, by T/2 minus half of the controller's
own step. A drive that reports just before the new reference has the same error in the other direction. Only the
part of the reference is affected, so no alignment of effort and motion corrects it. In a balance it acts like
damping k_p T/2 and inertia k_d T/2. An effort that is the mean over T is correct. So is, on average, an effort that
is not in step with the reference.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rhythmid.record.record import Channel

Array = NDArray[np.float64]
# length of the mean unit vector of the phases: timestamps that scatter by up to 7 % of the period
IN_STEP = 0.9
# share of the period before a reference's timestamp within which an effort counts as recorded with it
TAKEN_TOGETHER_SHARE = 0.1


@dataclass(frozen=True, eq=False)
class HeldReference:
    """A reference (n,), linear between its timestamps, and its period [s]."""

    between: Array
    period: float

    def moved(self, time: Array, lead: float) -> Array:
        """Change of the reference at `time` (n,) [s] if it is later by the lead."""
        return np.interp(time - lead, time, self.between) - self.between


def held_reference(effort: Channel, reference: Channel, grid: Array) -> HeldReference | None:
    """The reference at the times of a grid (n,); None where efforts are not recorded in step with it."""
    last = (
        np.searchsorted(reference.time, effort.time + TAKEN_TOGETHER_SHARE * reference.period, side="right")
        - 1
    )
    phases = (effort.time[last >= 0] - reference.time[last[last >= 0]]) / reference.period
    if len(phases) == 0 or abs(complex(np.mean(np.exp(2j * np.pi * phases)))) < IN_STEP:
        return None
    return HeldReference(np.interp(grid, reference.time, reference.value), reference.period)


def told_of(leads: Mapping[str, float]) -> Iterator[str]:
    """Messages about efforts that were corrected by these leads [s]."""
    if leads:
        most = 1e3 * max(leads.values(), key=abs)
        where = "ahead of" if most > 0.0 else "behind"
        yield (
            f"the efforts of {', '.join(leads)} are taken to have been recorded at the instants of references that are held: these are "
            f"{abs(most):.2g} ms {where} what acts, which is allowed for; say what they are with sampled: mean or instant under 'effort:'"
        )
