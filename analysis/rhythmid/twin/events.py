"""Events: mismatches from beginning to end, in a form for users."""

from collections import deque
from dataclasses import asdict, dataclass, replace
from typing import Any

from rhythmid.twin.detector import WINDOWS
from rhythmid.twin.isolation import DelayNow, Isolation
from rhythmid.twin.twin import Status


@dataclass(frozen=True)
class Event:
    """A mismatch.

    Attributes
    ----------
    since : time when it was first detected [s].
    until : time when it was last detected [s]; None while it lasts.
    peak : largest statistic: 0 in healthy operation, 1 at the threshold.
    isolation, delays : as last detected; when the change has ended, those of the last window before its end.
    diagnosis : verdict and names of a diagnosis of its last minute; None where there was none.
    """

    since: float
    until: float | None
    peak: float
    isolation: Isolation | None
    delays: dict[str, DelayNow]
    diagnosis: dict[str, Any] | None = None

    def to_dict(self) -> dict[str, Any]:
        """Plain data for JSON; times in seconds."""
        where = self.isolation
        return {
            "since": self.since,
            "until": self.until,
            "peak": self.peak,
            "slot": None if where is None else where.slot,
            "rivals": [] if where is None else list(where.rivals),
            "share": {} if where is None else where.share,
            "changes": [] if where is None else [asdict(one) for one in where.changes],
            "delays": {name: {"value": one.value, "std": one.std, "unit": "s"} for name, one in self.delays.items()},
            "diagnosis": self.diagnosis,
        }  # fmt: skip

    def sentence(self) -> str:
        """One line of text."""
        where = self.isolation
        told = "in no slot that is known"
        if where is not None and where.slot != "unknown":
            first = where.changes[0]
            told = " or ".join(f"in {slot}" for slot in (where.slot, *where.rivals))
            told += f"; {first.name} {first.size:+.3g} ± {2.0 * first.std:.1g} {first.unit} would explain {100 * where.share[where.slot]:.0f} %"
        end = "" if self.until is None else f" to {self.until:.1f} s"
        return f"from {self.since:.1f} s{end}: {told}"


class Events:
    """The mismatches that a twin has reported.

    A change that ends is detected for as long as the longest window still holds a part of it. Windows that hold the time after it as
    well mix two states of the machine, and no single change explains them. So the location of an event that has ended is that of
    one window length before its last detection.
    """

    def __init__(self) -> None:
        self.found: list[Event] = []
        self._seen = 0.0  # time when the last one was last detected
        # detections of the present one, from the last window that a change which is no longer detected has filled
        self._windows: deque[Status] = deque()

    @property
    def current(self) -> Event | None:
        """The present mismatch; None without one."""
        return self.found[-1] if self.found and self.found[-1].until is None else None

    def take(self, status: Status) -> None:
        """Update from a status of the twin."""
        now = self.current
        if status.since is None:
            if now is not None:
                self.found[-1] = replace(now, until=self._seen)
        elif status.isolation is None:
            return  # late messages: nothing is known of this window
        elif now is None:
            self._windows.clear()
            self._detect(status)
            self.found.append(Event(status.since, None, status.mismatch, status.isolation, status.delays))
        elif status.mismatch >= 1.0:
            self._detect(status)
            self.found[-1] = replace(
                now, peak=max(now.peak, status.mismatch), isolation=status.isolation, delays=status.delays
            )
        else:  # the change has ended, unless it is detected again
            during = self._windows[0]
            self.found[-1] = replace(now, isolation=during.isolation, delays=during.delays)

    def _detect(self, status: Status) -> None:
        self._seen = status.time
        self._windows.append(status)
        while len(self._windows) > 1 and self._windows[1].time <= self._seen - sum(WINDOWS):
            self._windows.popleft()

    def diagnosed(self, since: float, answer: dict[str, Any]) -> None:
        """Add a diagnosis to the event that began at `since`."""
        self.found = [replace(one, diagnosis=answer) if one.since == since else one for one in self.found]
