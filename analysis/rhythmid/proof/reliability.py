"""Reliability diagram: are stated probabilities as often right as they say?"""

from collections.abc import Sequence
from typing import Any

from rhythmid.proof.rate import Rate
from rhythmid.proof.score import Score, Stated

EDGES = (0.0, 0.5, 0.7, 0.85, 0.95, 1.0)


def binned(scores: Sequence[Score]) -> list[tuple[tuple[float, float], list[Stated]]]:
    """All names in answers, whatever the verdict, by probability; a bin's upper edge belongs to the next bin."""
    stated = [one for score in scores for one in score.stated]
    bins = list(zip(EDGES, EDGES[1:]))
    return [
        (
            (low, high),
            [s for s in stated if low <= s.probability and (s.probability < high or high == EDGES[-1])],
        )
        for low, high in bins
    ]


def reliability(scores: Sequence[Score]) -> list[dict[str, Any]]:
    """For each bin: mean stated probability, rate of correct names with Wilson's interval, and whether the mean is within it."""
    found: list[dict[str, Any]] = []
    for (low, high), some in binned(scores):
        right = Rate(sum(one.right for one in some), len(some))
        mean = sum(one.probability for one in some) / len(some) if some else None
        inside = None if mean is None else right.interval[0] <= mean <= right.interval[1]
        found.append({"from": low, "to": high, "stated": mean, "right": right.to_dict(), "inside": inside})
    return found


def reliability_lines(scores: Sequence[Score]) -> list[str]:
    """The same as lines of Markdown; empty where nothing was stated."""
    if not any(score.stated for score in scores):
        return []
    lines = ["", "## Stated probabilities", "", "| stated | mean | right |", "| --- | --- | --- |"]
    for (low, high), some in binned(scores):
        if some:
            mean = sum(one.probability for one in some) / len(some)
            right = Rate(sum(one.right for one in some), len(some))
            lines.append(f"| {low:g}–{high:g} | {mean:.2f} | {right} |")
    return lines
