"""Reliability diagram: are stated probabilities as often right as they say?"""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from rhythmid.proof.rate import Rate
from rhythmid.proof.score import Score, Stated

if TYPE_CHECKING:
    from matplotlib.axes import Axes

EDGES = (0.0, 0.5, 0.7, 0.85, 0.95, 1.0)
ASIDE = 0.012  # distance of a curve's points from the mean probability, so that intervals do not cover one another


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


def draw_reliability(axis: "Axes", scores: Sequence[Score]) -> None:
    """Draw the rate of right names over the mean stated probability of each bin, with Wilson's intervals and numbers of names.

    Cases whose law the catalogue lacks have a curve of their own: there every name of another law counts as wrong.
    """
    groups = {
        "the law is in the catalogue": [one for one in scores if one.kind != "left-out"],
        "the law is not in the catalogue": [one for one in scores if one.kind == "left-out"],
    }
    axis.plot([0.0, 1.0], [0.0, 1.0], color="0.6", linestyle=":")
    for place, (label, some) in enumerate(groups.items()):
        bins = [row for row in reliability(some) if row["right"]["of"]]
        if not bins:
            continue
        at = [row["stated"] + (place - 0.5) * 2.0 * ASIDE for row in bins]
        share = [row["right"]["share"] for row in bins]
        below = [row["right"]["share"] - row["right"]["interval"][0] for row in bins]
        above = [row["right"]["interval"][1] - row["right"]["share"] for row in bins]
        drawn = axis.errorbar(at, share, yerr=(below, above), marker="o", capsize=3.0, label=label)
        for x, y, row in zip(at, share, bins, strict=True):
            axis.annotate(
                f"{row['right']['of']}", (x, y), xytext=(5.0 * (2 * place - 1), 4.0), textcoords="offset points",
                ha="left" if place else "right", fontsize="small", color=drawn.lines[0].get_color(),
            )  # fmt: skip
    axis.set_xlim(0.0, 1.05)
    axis.set_ylim(-0.03, 1.05)
    axis.set_xlabel("stated probability of a name (mean of each bin)")
    axis.set_ylabel("share of names that are right")
    axis.legend(loc="upper left", fontsize="small")
    axis.grid(alpha=0.3)
