"""A case: the question that a diagnosis is asked, and what all of its parts need."""

import math
import time
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field

from rhythmid.elements.catalogue import Catalogue
from rhythmid.model import Model
from rhythmid.progress import Tell
from rhythmid.record.record import Record

# Shares of the budget by which three parts end: the search of the catalogue; the weighing of hypotheses and other kinds
# of explanation; everything that a verdict does not need. A part in progress then returns what it has. The rest of the
# budget is for the mandatory steps (measured with three times as much other work on the processors: the time from the
# end of the search to the answer is a third of the whole).
SEARCHED, WEIGHED, EXPLAINED = 0.6, 0.8, 0.9
LEAST_CALIBRATION = 10.0  # [s] allowed for refitting the nominal model, whatever the budget: without this fit no statement is possible


@dataclass(frozen=True)
class Budget:
    """Wall-clock time [s] for the answer, counted from the creation of the budget; None for no limit."""

    seconds: float | None = None
    began: float = field(default_factory=time.monotonic)

    def at(self, share: float, least: float = 0.0) -> float:
        """The time at which this share of the budget will have passed, at least `least` [s] from its start; infinite without a limit."""
        return math.inf if self.seconds is None else self.began + max(share * self.seconds, least)

    def passed(self, share: float) -> bool:
        """Whether this share of the budget has passed."""
        return time.monotonic() > self.at(share)

    def part(self, share: float, parts: int) -> "Budget":
        """The budget of one of `parts` equal parts of the time that is left until this share has passed; without a limit as this one."""
        if self.seconds is None:
            return self
        now = time.monotonic()
        return Budget(max(self.at(share) - now, 0.0) / parts, now)

    def allows(self, seconds: float, share: float) -> bool:
        """Whether what takes so long would end before this share of the budget has passed."""
        return time.monotonic() + seconds <= self.at(share)

    @property
    def spent(self) -> bool:
        """Whether the search must not begin anything new."""
        return self.passed(SEARCHED)


@dataclass(frozen=True)
class Untried:
    """A candidate, or another step, that was not tried, and the reason."""

    name: str
    reason: str


@dataclass(frozen=True)
class Case:
    """Records and the nominal model, the catalogue to search, and the workers.

    Parameters
    ----------
    nominal : the model as given.
    records, holdout : cleaned records of the diagnosis; without `holdout` the last fifth of each record is held out.
    catalogue : elements that may be missing.
    pool : threads that simulate.
    tell : called with a sentence at the beginning of each step.
    budget : time for the answer.
    """

    nominal: Model
    records: Sequence[Record]
    holdout: Sequence[Record]
    catalogue: Catalogue
    pool: ThreadPoolExecutor | None = None
    tell: Tell = lambda _: None
    budget: Budget = field(default_factory=Budget)
