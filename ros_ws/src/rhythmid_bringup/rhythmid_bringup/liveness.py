"""Whether the nodes still work: each node continues to report its figures, and relays keep up with their sources."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

SILENT_AFTER = 5.0  # seconds; five times the period at which every node reports its figures
STEP = 1.0  # seconds counted at most between two checks, because in a longer pause the supervisor itself was stopped


@dataclass(frozen=True)
class Relay:
    """A node that forwards messages: their source, and the longest time [s] for which it may hold them.

    `sent` and `relayed` name the counters among the figures of the two.
    """

    source: str
    sent: str
    delay: float
    relayed: str = "relayed"


@dataclass
class Liveness:
    """Monitors the nodes by their figures on /diagnostics.

    Parameters
    ----------
    relays
        By the name of the node.
    """

    relays: Mapping[str, Relay]
    _time: float = 0.0
    _looked_at: float | None = None
    _counts: dict[tuple[str, str], tuple[int, float]] = field(default_factory=dict)

    def silent(self, now: float, heard: Mapping[str, int]) -> list[str]:
        """The nodes that have reported nothing for `SILENT_AFTER`.

        Parameters
        ----------
        now
            Time of this check [s].
        heard
            How many times each node has reported its figures.
        """
        self._time += min(STEP, now - (now if self._looked_at is None else self._looked_at))
        self._looked_at = now
        return [
            name for name, count in heard.items() if self._time - self._moved(name, "", count) > SILENT_AFTER
        ]

    def stalled(self, figures: Mapping[str, Mapping[str, str]]) -> str:
        """The first relay that forwards nothing although its source continues to send, with the figures of both; else ''."""
        for name, relay in self.relays.items():
            try:
                sent, relayed = int(figures[relay.source][relay.sent]), int(figures[name][relay.relayed])
            except KeyError:
                continue  # not reported yet
            behind = self._moved(relay.source, relay.sent, sent) - self._moved(name, relay.relayed, relayed)
            if behind > relay.delay + SILENT_AFTER:
                return f"{name} has passed nothing on for {behind:.0f} s: {relayed} messages of {sent} that {relay.source} sent"
        return ""

    def _moved(self, name: str, key: str, count: int) -> float:
        """Time of the last observed change of the count."""
        before, at = self._counts.get((name, key), (None, 0.0))
        if count != before:
            at = self._time
            self._counts[name, key] = count, at
        return at
