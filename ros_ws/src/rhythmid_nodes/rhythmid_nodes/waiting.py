"""When a node that waits says so in its log: soon, and then seldom."""

from __future__ import annotations

FIRST = (
    2.0  # seconds of waiting before the first line: nodes that are started together find each other sooner
)
AGAIN = 10.0  # seconds from one line to the next at least


class Waiting:
    """Decides by the times of its calls, which may come at any interval."""

    def __init__(self) -> None:
        self._since: float | None = None
        self._told_at: float | None = None

    def due(self, waits: bool, now: float) -> bool:
        """Whether to say at time `now` [s] what the node waits for, if it `waits`."""
        if not waits:
            self._since = None
            return False
        self._since = now if self._since is None else self._since
        due = now - self._since >= FIRST and (self._told_at is None or now - self._told_at >= AGAIN)
        if due:
            self._told_at = now
        return due
