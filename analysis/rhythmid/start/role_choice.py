"""Knowledge about recorded numbers while roles are assigned, and the choice for a role."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from rhythmid.record.inventory import Recorded
from rhythmid.start.meaning import Meaning
from rhythmid.start.vocabulary import Quantity

Ask = Callable[
    [str, Sequence[str]], int
]  # a question and its possible answers, best first -> index of the answer
CLOSE_WORTH = 0.7  # ratio to the best candidate's score above which the user is asked about another one


@dataclass(frozen=True, eq=False)
class Choice:
    """The choice for a role, its reason, the alternatives, and doubts about it. Its values are `scale` times those of
    the number, plus `offset`, or plus the one of `offsets` for a record where there are any."""

    recorded: Recorded
    reason: str
    others: tuple[Recorded, ...] = ()
    doubts: tuple[str, ...] = ()
    scale: float = 1.0
    offset: float = 0.0
    offsets: Mapping[str, float] = field(default_factory=dict)

    def to_dict(self) -> dict[str, Any]:
        """Plain values for JSON."""
        return {
            "channel": str(self.recorded),
            "reason": self.reason,
            "others": [str(one) for one in self.others],
            "doubts": list(self.doubts),
            "scale": self.scale * self.recorded.scale,
            "offset": dict(self.offsets) or self.offset,
        }


@dataclass(frozen=True, eq=False)
class Known:
    """A number with its meaning, and doubts from the data."""

    one: Recorded
    meaning: Meaning
    doubt: str = ""

    @property
    def quantity(self) -> Quantity | None:
        """Its quantity; None where nothing states it."""
        return self.meaning.quantity

    def taken_for(
        self, quantity: Quantity, reason: str = "the data say so", commanded: bool | None = None
    ) -> "Known":
        """The number with the quantity that the data support; `commanded` where they support that, too."""
        asked = self.meaning.commanded if commanded is None else commanded
        return replace(self, meaning=replace(self.meaning, quantity=quantity, reason=reason, commanded=asked))

    def doubted(self, doubt: str) -> "Known":
        """The number with a doubt added."""
        return replace(self, doubt=doubt)

    def of_base(self) -> "Known":
        """The number as a motion of the base."""
        return replace(self, meaning=replace(self.meaning, base=True))


def pick(question: str, ranked: Sequence[tuple[float, Recorded]], ask: Ask) -> int:
    """The best of the candidates, which are in descending order of score; the user is asked where others are close."""
    close = [one for worth, one in ranked if worth >= CLOSE_WORTH * ranked[0][0]]
    return ask(question, [str(one) for one in close]) if len(close) > 1 else 0


def ranked_by_worth(scored: Sequence[tuple[float, Known]]) -> list[tuple[float, Recorded]]:
    """Candidates in descending order of score."""
    return [(worth, one.one) for worth, one in sorted(scored, key=lambda pair: -pair[0])]


def strongest(able: Sequence[Known], reason: str) -> Choice:
    """The candidate that moves most."""
    ranked = sorted(able, key=lambda one: -float(np.nanstd(one.one.value)))
    return chosen(ranked[0], f"{reason}: {ranked[0].meaning.reason}", [one.one for one in ranked[1:]])


def chosen(picked: Known, reason: str, others: Sequence[Recorded] = ()) -> Choice:
    """The choice for a role, with the doubts about it."""
    return Choice(picked.one, reason, tuple(others), (picked.doubt,) if picked.doubt else ())
