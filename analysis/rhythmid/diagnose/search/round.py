"""One round of the search: scores of the whole catalogue at a fit."""

from collections.abc import Sequence
from dataclasses import dataclass

from rhythmid.diagnose.search.score_tests import Score


@dataclass(frozen=True)
class Round:
    """One round of the search: the scores, best first, and the probability of such a best score by chance; `added` are the
    labels of the effects that the scored model had already."""

    scores: tuple[Score, ...]
    p_value: float
    added: tuple[str, ...] = ()


def distinct(scores: Sequence[Score], count: int) -> list[tuple[Score, list[Score]]]:
    """The best score of each of the first `count` elements, with all scores of that element."""
    found: dict[str, list[Score]] = {}
    for one in scores:
        if one.statistic <= 0.0:
            continue
        found.setdefault(one.element.name, []).append(one)
    return [(group[0], group) for group in list(found.values())[:count]]
