"""What `rhythmid watch` prints where there is no terminal, such as into a file: a line at each change, and one at the end."""

from __future__ import annotations

from collections.abc import Mapping

from diagnostic_msgs.msg import DiagnosticStatus

from rhythmid_nodes.twin import ENDED, LAST, UNSTAMPED

from .board import MODEL


class WatchLines:
    """Makes lines of the newest statuses on /diagnostics, of one twin."""

    def __init__(self) -> None:
        self._said = ""  # the kind of the last message
        self._ended = 0
        self._unstamped: set[str] = set()
        self._message = "nothing was heard from the twin"

    def take(self, newest: Mapping[str, DiagnosticStatus]) -> list[str]:
        """Lines about what is new: the state, a mismatch that lasts, one that has ended, a signal without stamps."""
        lines: list[str] = []
        for name, status in sorted(newest.items()):
            values = {pair.key: pair.value for pair in status.values}
            for key in values:
                if key.endswith(UNSTAMPED) and key not in self._unstamped:
                    self._unstamped.add(key)
                    lines.append(f"{key}: {values[key]}")
            if name.endswith(MODEL):
                lines += self._model(status, values)
        return lines

    def end(self) -> str:
        """The last line."""
        return f"watch ended; mismatches that have ended: {self._ended}; now: {self._message}"

    def _model(self, status: DiagnosticStatus, values: Mapping[str, str]) -> list[str]:
        self._message = status.message
        lines = []
        ended = int(values.get(ENDED, "0"))
        if ended > self._ended:
            self._ended = ended
            lines.append(f"mismatch ended: {values[LAST]}")
        # a mismatch is told when it is confirmed: its slot is then that of a whole window
        kind = "mismatch" if status.level != DiagnosticStatus.OK else status.message
        if status.level != DiagnosticStatus.WARN and kind != self._said:
            self._said = kind
            lines.append(f"{kind}: {status.message}" if kind == "mismatch" else status.message)
        return lines
