"""Messages that never arrived, found by the sequence numbers that the middleware gives to every publisher's messages.

The middleware's own event, message lost, is not used. In rmw_fastrtps the thread that takes the event locks the event and
then the reader, and the thread that receives a message locks the reader and then the event, so both can wait for
each other for ever: https://github.com/ros2/rmw_fastrtps/pull/890.
"""

from __future__ import annotations

from bisect import bisect_left, insort


class SequenceGaps:
    """Counts in `lost` the numbers that are missing between the messages of one topic.

    A message continues the sequence whose newest number is the nearest below its own; rclpy does not tell which publisher
    sent it. With one publisher the count is exact. With several it is exact while none of them joins with a number above
    another's.
    """

    def __init__(self) -> None:
        self.lost = 0
        self._newest: list[int] = []  # of every sequence, in rising order

    def add(self, number: int) -> None:
        """Register the sequence number of the next message."""
        place = bisect_left(self._newest, number)
        if place:
            self.lost += number - self._newest.pop(place - 1) - 1
        insort(self._newest, number)
