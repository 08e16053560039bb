"""Probabilities of names: how much of the evidence is for hypotheses that hold them.

Hypotheses with no more effects than the chosen one share the evidence, as pseudo-BMA weights. A name's probability is the
share of those that hold it, times the chance that the catalogue holds the truth at all. That falls with how much is left that
something else explains, beside the part of the mismatch that the name explains; and with how little the records determine the effect's
size: where an effect improves the prediction by much, whatever its size is, it does so in a limit that other laws have as well.
"""

import math
from collections.abc import Sequence

import numpy as np

from rhythmid.diagnose.constants import (
    ADEQUATE,
    HOLDS,
    OPEN,
    PRIOR_ODDS,
    PRIOR_ODDS_OF_OTHERS,
    STEEPNESS,
    VAGUE,
    VAGUENESS,
)
from rhythmid.diagnose.evidence import probabilities
from rhythmid.diagnose.hypothesis import Hypothesis
from rhythmid.diagnose.rejections import keeps_shape
from rhythmid.diagnose.selection import Contest, Selection, beside_small_effects


def weights_of(contest: Contest, selection: Selection) -> dict[tuple[str, ...], float]:
    """Weight of each hypothesis, by its key, among those with no more effects than the chosen one."""
    chosen = selection.chosen
    sound = [one for one in contest.hypotheses if keeps_shape(one.shape)]
    rivals = [one for one in sound if len(one.elements) <= len(chosen.elements)]
    compared = [beside_small_effects(one, chosen, sound) for one in rivals]
    return {one.key: float(weight) for one, weight in zip(rivals, probabilities(compared))}


def adequacy(explained: float) -> float:
    """Chance that names which explain this share of what anything explains are the true ones.

    A logistic function of the logarithm of what they leave.
    """
    left = min(max(1.0 - explained, 1e-9), 1.0)
    return float(HOLDS / (1.0 + (left / ADEQUATE) ** STEEPNESS))


def resolved(error: float) -> float:
    """Chance that an effect is not only a limit of its law, where its size has this standard deviation relative to itself: from one down
    to `OPEN` by a logistic function of its logarithm."""
    known = 1.0 / (1.0 + (error / VAGUE) ** VAGUENESS) if error < math.inf else 0.0
    return float(OPEN + (1.0 - OPEN) * known)


def joint_probability(
    names: Sequence[str], contest: Contest, chosen: Hypothesis, weights: dict[tuple[str, ...], float]
) -> float:
    """Share of the evidence for hypotheses that hold all these names of the chosen one.

    A richer law that contains a name holds it, too: were it clearly better, it would have been chosen.
    """
    accepted = [({name, *chosen.richer.get(name, ())}, names.count(name)) for name in dict.fromkeys(names)]
    held = [
        weights.get(one.key, 0.0)
        for one in contest.hypotheses
        if all(sum(name in group for name in one.names) >= count for group, count in accepted)
    ]
    return float(np.clip(sum(held), 0.0, 1.0))


def prior_odds(family: str) -> float:
    """Prior odds of a family on real machines, over those with which the proof draws it; those of an element without a family are one."""
    return PRIOR_ODDS.get(family, PRIOR_ODDS_OF_OTHERS) if family else 1.0


def chance_of_law(share: float, left: float, size_error: float = 0.0, family: str = "") -> float:
    """Chance that an effect with this share of the mismatch is the law that its name says, where this much is left: of the part of the mismatch
    that it is to explain, what is left may be a part. The odds of that are those of the proof times the prior odds of its family."""
    own = share / (share + left) if share + left > 0.0 else 0.0
    chance = adequacy(own) * resolved(size_error)
    odds = prior_odds(family)
    return odds * chance / (1.0 - chance + odds * chance)


def removed_by(some: Sequence[str], chosen: Hypothesis, contest: Contest) -> float:
    """Share of the mismatch that these effects of a hypothesis remove beside its others. Laws that are hardly true remove what a law that
    is not known does. None where the model without them was not fitted."""
    whole = contest.nominal.prediction.mean_square - contest.floor
    others = set(chosen.elements) - set(some)
    without = [one.prediction.mean_square for one in contest.hypotheses if set(one.elements) == others]
    if whole <= 0.0 or not without:
        return 0.0
    return float(np.clip((min(without) - chosen.prediction.mean_square) / whole, 0.0, 1.0))
