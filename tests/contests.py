"""Contests made by hand: hypotheses whose predictions are plain numbers, for tests of what is decided on them."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from rhythmid.diagnose.constants import PRACTICAL
from rhythmid.diagnose.hypothesis import Hypothesis, Kind, Prediction
from rhythmid.diagnose.selection import Contest, Selection, select
from rhythmid.diagnose.verdict import Decision, decide

BLOCKS = 60
SAMPLES = 100.0  # of a block
SIZE = 10.0  # rms of what errors are a share of: a nominal model with a mean square of 1 misses a tenth of it
SEEN = 0.001  # smallest effect that the records would show, as a share of it


def predicted(
    mean_square: float, score: float | None = None, mood: float = 0.1, seed: int | None = None
) -> Prediction:
    """A prediction of 60 blocks of 100 samples with this mean squared error.

    Parameters
    ----------
    score : log predictive density of all blocks; by default that of Gaussian errors of this size, of which a tenth count.
    mood : standard deviation with which a block's log density departs from the mean, no part of the score.
    seed : of these departures; by default they are of a size of their own for every mean square.
    """
    rng = np.random.default_rng(int(1e9 * mean_square) % 2**31 if seed is None else seed)
    departures = rng.standard_normal(BLOCKS)
    departures -= departures.mean()
    departures *= mood / departures.std(ddof=1)
    if score is None:
        score = -5.0 * BLOCKS * float(np.log(mean_square))
    blocks = np.full(BLOCKS, SAMPLES)
    return Prediction(score / BLOCKS + departures, mean_square * blocks, blocks)


def ends(one: Prediction, gain: float, mood: float = 0.5, last: int = 12) -> Prediction:
    """The prediction with its last blocks held out, and a log density there of `gain` in each, give or take `mood`."""
    unseen = np.arange(BLOCKS) >= BLOCKS - last
    density = one.log_density.copy()
    density[unseen] = gain + np.resize([mood, -mood], last)
    return replace(one, log_density=density, unseen=unseen)


def supposed(
    elements: str,
    prediction: Prediction,
    kind: Kind | None = None,
    free: int | None = None,
    shape: Mapping[str, float] | None = None,
    richer: Mapping[str, tuple[str, ...]] | None = None,
    family: Mapping[str, str] | None = None,
) -> Hypothesis:
    """A hypothesis of effects, whose labels (split at spaces) are their names; `family` are their families."""
    labels = tuple(elements.split())
    chosen = kind or ("effects" if labels else "nominal")
    count = 5 + len(labels) if free is None else free
    return Hypothesis(
        labels, labels, chosen, count, prediction, 0.1, shape or {}, richer or {}, family=family or {}
    )


def contest(
    *hypotheses: Hypothesis, maps: Mapping[str, Prediction] | None = None, practical: float = PRACTICAL
) -> Contest:
    """The contest of these hypotheses, of thirty effects that were looked at."""
    return Contest(hypotheses, maps or {}, 30, SIZE, practical, practical)


def decided(
    made: Contest, detectable: float = SEEN, errors: Mapping[str, float] | None = None
) -> tuple[Selection, Decision]:
    """What is selected and decided, as an answer has it; `errors` are those of the effects' sizes, none by default."""
    chosen = select(made)
    return chosen, decide(made, chosen, detectable, errors or {})


def verdict(made: Contest, detectable: float = SEEN) -> tuple[str, tuple[str, ...]]:
    """The verdict that a user reads, and the names that come with it."""
    decision = decided(made, detectable)[1]
    return decision.verdict, decision.named


NOMINAL = supposed("", predicted(1.0))
LEFT_BY_FRICTION = 0.1
NAMED = ("missing_physics", ("friction",))  # what `verdict` gives for it
NOTHING = ("consistent", ())


def friction(mean_square: float = LEFT_BY_FRICTION, **changes) -> Hypothesis:
    """A model with friction, of this mean squared error."""
    return supposed("friction", predicted(mean_square, changes.pop("score", None)), **changes)
