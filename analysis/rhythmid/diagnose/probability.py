"""Probabilities of names: the share of the evidence held by hypotheses that contain them.

Hypotheses with no more effects than the chosen one share the evidence, as pseudo-BMA weights. A name's probability is the share of
those that contain it, times the chance that the catalogue holds the truth at all. That chance falls with the unexplained part that
something else explains, relative to the part that the name explains. It also falls if the records do not determine the effect's size:
an effect that improves the prediction whatever its size does so at a limit of its law, which other laws share.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from rhythmid.diagnose.constants import (
    ADEQUATE,
    HOLDS,
    OPEN,
    PRIOR_ODDS,
    SMALL,
    STATED,
    STEEPNESS,
    VAGUE,
    VAGUENESS,
)
from rhythmid.diagnose.evidence import probabilities
from rhythmid.diagnose.hypothesis import Hypothesis
from rhythmid.diagnose.rejections import keeps_shape
from rhythmid.diagnose.selection import Contest, Selection


@dataclass(frozen=True)
class Names:
    """The names of the chosen hypothesis' effects, and how probable they are.

    Parameters
    ----------
    contest, chosen : all hypotheses, and the chosen one.
    labels : its effects that may be named, the largest share first.
    weights : weight of each hypothesis, by its key.
    in_place : for each label the chance that the effect stands in the place of an unknown law, and the share of the mismatch that it
        removes.
    law : for each label the chance that the effect is the law that its name says, where the hypothesis is true.
    """

    contest: Contest
    chosen: Hypothesis
    labels: tuple[str, ...]
    weights: Mapping[tuple[str, ...], float]
    in_place: Mapping[str, tuple[float, float]]
    law: Mapping[str, float]

    @classmethod
    def of(
        cls,
        contest: Contest,
        selection: Selection,
        labels: tuple[str, ...],
        shares: Mapping[str, float],
        left: float,
        size_errors: Mapping[str, float],
    ) -> "Names":
        """Probabilities, given the effects' shares of the mismatch, the share `left`, and the relative deviations of the sizes."""
        chosen = selection.chosen
        names = dict(zip(chosen.elements, chosen.names))
        family = {label: chosen.family.get(names[label], "") for label in labels}

        def chance(label: str, left: float) -> float:
            return chance_of_law(shares[label], left, size_errors.get(label, 0.0), family[label])

        in_place = {
            label: (doubt(chance(label, left), family[label]), removed_by(label, chosen, contest))
            for label in labels
        }
        law = {
            label: chance_beside(
                [in_place[one] for one in labels if names[one] != names[label]], partial(chance, label), left
            )
            for label in labels
        }
        return cls(contest, chosen, labels, weights_of(contest, selection), in_place, law)

    def name(self, label: str) -> str:
        """The element's name of an effect."""
        return self.chosen.names[self.chosen.elements.index(label)]

    def evidence_for(self, labels: Sequence[str]) -> float:
        """Share of the evidence held by hypotheses that contain the names of all these effects."""
        return joint_probability(
            [self.name(label) for label in labels], self.contest, self.chosen, self.weights
        )

    def probability(self, labels: Sequence[str]) -> float:
        """Joint probability of these effects.

        Of effects with the same name, a smaller one exists only beside the larger ones.
        """
        last: dict[str, int] = {}  # place of the smallest of these effects, by name
        for label in labels:
            name = self.name(label)
            last[name] = max(last.get(name, 0), self.labels.index(label))
        held = [one for place, one in enumerate(self.labels) if place <= last.get(self.name(one), -1)]
        return min((self.law[label] for label in labels), default=1.0) * self.evidence_for(held)

    @property
    def stated(self) -> tuple[str, ...]:
        """As many effects, the largest shares first, as are jointly probable enough to be stated."""
        count = 0
        while count < len(self.labels) and self.probability(self.labels[: count + 1]) >= STATED:
            count += 1
        return self.labels[:count]


def weights_of(contest: Contest, selection: Selection) -> dict[tuple[str, ...], float]:
    """Weight of each hypothesis, by key, among those with no more effects than the chosen one."""
    chosen = selection.chosen
    rivals = [
        one
        for one in contest.hypotheses
        if keeps_shape(one.shape) and len(one.elements) <= len(chosen.elements)
    ]
    return {one.key: float(weight) for one, weight in zip(rivals, probabilities(rivals))}


def adequacy(explained: float) -> float:
    """Chance that names are the true ones if they explain this share of the explainable mismatch.

    A logistic function of the logarithm of the unexplained share.
    """
    left = min(max(1.0 - explained, 1e-9), 1.0)
    return float(HOLDS / (1.0 + (left / ADEQUATE) ** STEEPNESS))


def resolved(error: float) -> float:
    """Chance that an effect is not only a limit of its law, given the relative standard deviation of its size.

    A logistic function of the logarithm of `error`, falling from one to `OPEN`.
    """
    known = 1.0 / (1.0 + (error / VAGUE) ** VAGUENESS) if error < math.inf else 0.0
    return float(OPEN + (1.0 - OPEN) * known)


def joint_probability(
    names: Sequence[str], contest: Contest, chosen: Hypothesis, weights: Mapping[tuple[str, ...], float]
) -> float:
    """Share of the evidence held by hypotheses that contain all these names of the chosen one.

    A richer law that contains a named one counts, too: if it were clearly better, it would have been chosen.
    """
    accepted = [({name, *chosen.richer.get(name, ())}, names.count(name)) for name in dict.fromkeys(names)]
    held = [
        weights.get(one.key, 0.0)
        for one in contest.hypotheses
        if all(sum(name in group for name in one.names) >= count for group, count in accepted)
    ]
    return float(np.clip(sum(held), 0.0, 1.0))


def prior_odds(family: str) -> float:
    """Prior odds of a family on real machines relative to the proof; one for an element without a family."""
    return PRIOR_ODDS.get(family, 1.0)


def chance_of_law(share: float, left: float, size_error: float = 0.0, family: str = "") -> float:
    """Chance that an effect is the law that its name says.

    Parameters
    ----------
    share, left : shares of the mismatch that the effect explains and that is left; see `of_own`.
    size_error : relative standard deviation of the effect's size.
    family : its family, whose prior odds multiply the odds found in the proof.
    """
    left = of_own(share, left)
    own = share / (share + left) if share + left > 0.0 else 0.0
    chance = adequacy(own) * resolved(size_error)
    odds = prior_odds(family)
    return odds * chance / (1.0 - chance + odds * chance)


def of_own(share: float, left: float) -> float:
    """The part of what is left that may belong to what an effect should explain, as a share of the mismatch.

    Small effects that the model lacks leave about `SMALL` of the mismatch, whichever effect is the true law: of this the effect answers
    for its share. All that is left beyond may be its own.
    """
    return share * min(left, SMALL) + max(left - SMALL, 0.0)


def doubt(chance: float, family: str) -> float:
    """Chance that an effect stands in the place of an unknown law, as far as its share or the deviation of its size tell.

    That the catalogue may lack a law although it explains everything does not count here: it puts no other law in doubt.
    """
    return 1.0 - chance / chance_of_law(1.0, 0.0, 0.0, family)


def chance_beside(
    others: Sequence[tuple[float, float]], chance: Callable[[float], float], left: float
) -> float:
    """Chance that an effect is the law that its name says, where others beside it may stand in the place of unknown laws.

    Parameters
    ----------
    others : doubt about each other effect, and the share of the mismatch that it removes. With that chance the share is left.
    chance : the chance as a function of the share that is left.
    left : the share that is left where all other effects are true laws.
    """
    if not others:
        return chance(left)
    (doubted, share), *rest = others
    return (1.0 - doubted) * chance_beside(rest, chance, left) + doubted * chance_beside(
        rest, chance, left + share
    )


def removed_by(label: str, chosen: Hypothesis, contest: Contest) -> float:
    """Share of the mismatch that an effect of a hypothesis removes beside its others.

    Where the model without it was not fitted, the best one with some of the others takes its place.
    """
    whole = contest.mismatch
    others = set(chosen.elements) - {label}
    without = [one.prediction.mean_square for one in contest.hypotheses if set(one.elements) <= others]
    if whole <= 0.0:
        return 0.0
    return float(np.clip((min(without) - chosen.prediction.mean_square) / whole, 0.0, 1.0))
