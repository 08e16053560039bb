"""Distinguishes the messages of publishers."""

from __future__ import annotations

from collections.abc import Callable


class SequenceCheck:
    """Distinguishes publishers by the sequence numbers that the middleware gives to the messages of each publisher.

    `foreign` counts the messages that were refused.
    """

    def __init__(self) -> None:
        self.foreign = 0
        self._last: int | None = None

    @property
    def begun(self) -> bool:
        """Whether a message was admitted."""
        return self._last is not None

    def admits(self, number: int, publishers: Callable[[], int]) -> bool:
        """Whether the message with that number continues the sequence.

        While there is only one publisher, a number out of order counts as a loss, or as a publisher that replaced another;
        `publishers()`, their number, is called only then.
        """
        if self._last is None or number == self._last + 1 or publishers() <= 1:
            self._last = number
            return True
        self.foreign += 1
        return False
