"""How many elements of a round are refitted: those that score as well as the best are not told apart by their scores."""

import pytest

from rhythmid.diagnose.search.proposals import refitted
from rhythmid.diagnose.search.round import Round
from rhythmid.diagnose.search.score_tests import Score
from rhythmid.elements.catalogue import load_catalogue


def scored(*statistics: float) -> Round:
    """A round in which elements of the catalogue have these statistics, each from two guesses."""
    scores = []
    for element, statistic in zip(load_catalogue().values(), statistics):
        for share in (1.0, 0.5):
            scores.append(Score(element, {}, share * statistic, 1.0, {}))
    return Round(tuple(sorted(scores, key=lambda one: -one.statistic)), 1e-6)


@pytest.mark.parametrize(
    "statistics, expected",
    [
        ((500.0, 40.0, 30.0, 20.0, 10.0), 3),
        ((41.3, 40.4, 39.0, 38.3, 36.7, 21.4, 11.0), 5),
        ((41.0, 31.5, 30.5, 5.0), 3),
        ((2.0, 1.0), 3),
    ],
)
def test_all_that_score_as_well_as_the_best_are_refitted_and_never_fewer_than_asked_for(statistics, expected):
    assert refitted(scored(*statistics), 3) == expected


def test_a_round_without_scores_asks_for_the_least():
    assert refitted(Round((), 1.0), 4) == 4
