"""Events: mismatches from beginning to end, in a form for users."""

from dataclasses import asdict, dataclass, replace
from typing import Any

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
    isolation, delays : as last detected.
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
    """The mismatches that a twin has reported."""

    def __init__(self) -> None:
        self.found: list[Event] = []
        self._seen = 0.0  # time when the last one was last detected

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
        elif now is None:
            self._seen = status.time
            self.found.append(Event(status.since, None, status.mismatch, status.isolation, status.delays))
        elif status.mismatch >= 1.0:
            self._seen = status.time
            self.found[-1] = replace(
                now, peak=max(now.peak, status.mismatch), isolation=status.isolation, delays=status.delays
            )

    def diagnosed(self, since: float, answer: dict[str, Any]) -> None:
        """Add a diagnosis to the event that began at `since`."""
        self.found = [replace(one, diagnosis=answer) if one.since == since else one for one in self.found]
