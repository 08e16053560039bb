"""A case: what a diagnosis is asked, and what all of its parts need."""

import math
import time
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field

from rhythmid.elements.catalogue import Catalogue
from rhythmid.model import Model
from rhythmid.progress import Tell
from rhythmid.record.record import Record

# shares of a budget up to which the catalogue is searched, hypotheses and other kinds of explanation are weighed, and what is not needed for
# a verdict is computed. What is under way then ends with what it has, and what has to be done takes the rest (measured where processors
# are shared with three times as much other work: from the end of the search to the answer a third of the whole)
SEARCHED, WEIGHED, EXPLAINED = 0.6, 0.8, 0.9
LEAST_CALIBRATION = 10.0  # s in which the nominal model may be refitted, however small a budget is: without that nothing can be said


@dataclass(frozen=True)
class Budget:
    """Seconds on the wall clock, from when the budget was made, in which an answer is due; None for as long as it needs."""

    seconds: float | None = None
    began: float = field(default_factory=time.monotonic)

    def at(self, share: float, least: float = 0.0) -> float:
        """When so large a share of it will have passed, but `least` [s] at least; infinite without any seconds."""
        return math.inf if self.seconds is None else self.began + max(share * self.seconds, least)

    def passed(self, share: float) -> bool:
        """Whether so large a share of it has passed."""
        return time.monotonic() > self.at(share)

    @property
    def spent(self) -> bool:
        """Whether the search is to begin nothing more."""
        return self.passed(SEARCHED)


@dataclass(frozen=True)
class Case:
    """Records and the nominal model, the catalogue to search, and the workers.

    Parameters
    ----------
    nominal : the model as given.
    records, holdout : as given to the diagnosis, made tidy; without `holdout` the last fifth of each record is held out.
    catalogue : elements that may be missing.
    pool : threads that simulate.
    tell : is told what begins.
    budget : time for the answer.
    """

    nominal: Model
    records: Sequence[Record]
    holdout: Sequence[Record]
    catalogue: Catalogue
    pool: ThreadPoolExecutor | None = None
    tell: Tell = lambda _: None
    budget: Budget = field(default_factory=Budget)
