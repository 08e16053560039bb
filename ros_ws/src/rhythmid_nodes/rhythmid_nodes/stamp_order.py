"""Sorts messages of lockstep topics by simulated time, in whatever order the middleware delivered them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from heapq import heappop, heappush

Message = tuple[str, int, bytes]  # topic, simulated time [ns], serialised message


class StampOrder:
    """Hands out messages by stamp, and those of one stamp by the order of `topics`.

    A message waits until every stream has passed its stamp. The topic without stamps, `state`, is published at the beginning and
    at the end of a run: its first message precedes all others, its further messages follow all others.
    """

    def __init__(self, topics: Sequence[str], streams: Sequence[str], state: str | None) -> None:
        self._rank = {topic: rank for rank, topic in enumerate(topics)}
        self._newest = dict.fromkeys(streams, -1)
        self._state = state
        self._begun = state is None
        self._waiting: list[tuple[int, int, int, Message]] = []
        self._last: list[bytes] = []
        self._count = 0

    def add(self, topic: str, stamp_ns: int, data: bytes) -> None:
        """Take a message."""
        if topic == self._state:
            if self._begun:
                self._last.append(data)
                return
            self._begun, stamp_ns = True, 0
        elif topic in self._newest:
            self._newest[topic] = max(self._newest[topic], stamp_ns)
        self._count += 1
        rank = -1 if topic == self._state else self._rank[topic]
        heappush(self._waiting, (stamp_ns, rank, self._count, (topic, stamp_ns, data)))

    def ready(self) -> Iterator[Message]:
        """The messages that no later message can precede."""
        if self._begun:
            passed = min(self._newest.values(), default=-1)
            while self._waiting and self._waiting[0][0] < passed:
                yield heappop(self._waiting)[-1]

    def rest(self) -> Iterator[Message]:
        """All messages left, when no more will come."""
        end = max(self._newest.values(), default=0)
        while self._waiting:
            yield heappop(self._waiting)[-1]
        for data in self._last:
            assert self._state is not None
            yield self._state, max(0, end), data
        self._last.clear()
