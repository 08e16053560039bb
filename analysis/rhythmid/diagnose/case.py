"""A case: what a diagnosis is asked, and what all of its parts need."""

import time
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field

from rhythmid.elements.catalogue import Catalogue
from rhythmid.model import Model
from rhythmid.progress import Tell
from rhythmid.record.record import Record

SPENT = "the time given was spent"  # why something was not tried


@dataclass(frozen=True)
class Budget:
    """Seconds on the wall clock, from when the budget was made, after which a search begins nothing more; None for as long as
    it needs."""

    seconds: float | None = None
    began: float = field(default_factory=time.monotonic)

    @property
    def spent(self) -> bool:
        """Whether no more is to be begun."""
        return self.seconds is not None and time.monotonic() - self.began > self.seconds


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
    budget : time for the search.
    """

    nominal: Model
    records: Sequence[Record]
    holdout: Sequence[Record]
    catalogue: Catalogue
    pool: ThreadPoolExecutor | None = None
    tell: Tell = lambda _: None
    budget: Budget = field(default_factory=Budget)
