"""What is known of a recorded number while roles are guessed, and what plays one."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from rhythmid.record.inventory import Recorded
from rhythmid.start.meaning import Meaning, Quantity

Ask = Callable[
    [str, Sequence[str]], int
]  # a question and its possible answers, the best first -> number of the answer
CLOSE_WORTH = 0.7  # of the best candidate's worth, from which another one is worth a question


@dataclass(frozen=True, eq=False)
class Choice:
    """What plays a role, why, what else might, and what is doubtful about it."""

    recorded: Recorded
    reason: str
    others: tuple[Recorded, ...] = ()
    doubts: tuple[str, ...] = ()

    def to_dict(self) -> dict[str, Any]:
        """Plain values for JSON."""
        return {
            "channel": str(self.recorded),
            "reason": self.reason,
            "others": [str(one) for one in self.others],
            "doubts": list(self.doubts),
        }


@dataclass(frozen=True, eq=False)
class Known:
    """A number with its meaning, and what is doubtful about it where the data say it."""

    one: Recorded
    meaning: Meaning
    doubt: str = ""

    @property
    def quantity(self) -> Quantity | None:
        """What it is, None where nothing says it."""
        return self.meaning.quantity

    def taken_for(
        self, quantity: Quantity, reason: str = "the data say so", commanded: bool | None = None
    ) -> "Known":
        """The number as what the data say that it is; `commanded` where they say that, too."""
        asked = self.meaning.commanded if commanded is None else commanded
        return replace(self, meaning=replace(self.meaning, quantity=quantity, reason=reason, commanded=asked))

    def doubted(self, doubt: str) -> "Known":
        """The number with what is doubtful about it."""
        return replace(self, doubt=doubt)

    def of_base(self) -> "Known":
        """The number as a motion of the base."""
        return replace(self, meaning=replace(self.meaning, base=True))


def pick(question: str, ranked: Sequence[tuple[float, Recorded]], ask: Ask) -> int:
    """The best of candidates in falling order of worth; asked for where others are close."""
    close = [one for worth, one in ranked if worth >= CLOSE_WORTH * ranked[0][0]]
    return ask(question, [str(one) for one in close]) if len(close) > 1 else 0


def ranked_by_worth(scored: Sequence[tuple[float, Known]]) -> list[tuple[float, Recorded]]:
    """Candidates in falling order of worth."""
    return [(worth, one.one) for worth, one in sorted(scored, key=lambda pair: -pair[0])]


def strongest(able: Sequence[Known], reason: str) -> Choice:
    """Of several candidates the one that moves most."""
    ranked = sorted(able, key=lambda one: -float(np.nanstd(one.one.value)))
    return chosen(ranked[0], f"{reason}: {ranked[0].meaning.reason}", [one.one for one in ranked[1:]])


def chosen(picked: Known, reason: str, others: Sequence[Recorded] = ()) -> Choice:
    """What plays a role, with what is doubtful about it."""
    return Choice(picked.one, reason, tuple(others), (picked.doubt,) if picked.doubt else ())
