"""Telling one publisher's messages from another's."""

from __future__ import annotations

from collections.abc import Callable


class SequenceCheck:
    """Tells one publisher's messages from another's by the sequence numbers that the middleware gives to each publisher's own.

    `foreign` counts the messages that were refused.
    """

    def __init__(self) -> None:
        self.foreign = 0
        self._last: int | None = None

    def admits(self, number: int, publishers: Callable[[], int]) -> bool:
        """Whether the message with that number goes on where the last one ended.

        A number out of order is taken for a loss, or for a publisher that took the place of another, while there is but one;
        `publishers()`, how many there are, is asked only then.
        """
        if self._last is None or number == self._last + 1 or publishers() <= 1:
            self._last = number
            return True
        self.foreign += 1
        return False
