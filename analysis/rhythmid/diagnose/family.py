"""Families: the kind of physics that is missing, which the records may tell where they do not tell the law.

Coulomb friction, Stribeck friction and hysteresis are laws of one family. Where several of them predict about as well, or where each
leaves a little that the true one would not, each name is uncertain and the family is not.
"""

from collections.abc import Collection, Mapping
from dataclasses import dataclass

from rhythmid.diagnose.hypothesis import Hypothesis
from rhythmid.diagnose.probability import chance_of_law, removed_by
from rhythmid.diagnose.selection import Contest

LISTED = 0.01  # weight from which a law is listed: to about this the Bayesian bootstrap knows a weight, see `DRAWS`


@dataclass(frozen=True)
class MissingFamily:
    """A family of the catalogue of which the model lacks a law.

    Parameters
    ----------
    family : its name.
    laws : names of its laws that the evidence leaves open, the one with the largest weight first; the chosen ones among them.
    share : share of the mismatch on held-out data that the laws of the chosen hypothesis explain.
    probability : that the truth has a law of this family.
    """

    family: str
    laws: tuple[str, ...]
    share: float
    probability: float


def families_of(
    contest: Contest,
    chosen: Hypothesis,
    shares: Mapping[str, float],
    weights: Mapping[tuple[str, ...], float],
    left: float,
    open_: Collection[str],
    size_errors: Mapping[str, float],
) -> tuple[MissingFamily, ...]:
    """Families of the chosen hypothesis' effects, that with the largest share first.

    Parameters
    ----------
    shares, weights : of the effects by label, and of the hypotheses by key.
    left : share of the mismatch that the chosen hypothesis is expected to leave.
    open_ : labels of its effects that are hardly true; what those of another family explain may be this one's as well.
    size_errors : relative standard deviations of the effects' sizes, by label. The largest one of a family speaks for it: what is in a
        limit of its law may be one of a law of another family.
    """
    labels: dict[str, list[str]] = {}
    for label, name in zip(chosen.elements, chosen.names):
        if chosen.family.get(name):
            labels.setdefault(chosen.family[name], []).append(label)
    found = []
    for family, mine in labels.items():
        share = min(sum(shares[label] for label in mine), 1.0)
        others = [label for label in open_ if label not in mine]
        laws, held = _laws(contest, family, weights)
        vague = size_errors.get(max(mine, key=lambda label: shares[label]), 0.0)
        chance = chance_of_law(share, left + removed_by(others, chosen, contest), vague, family) * held
        own = [
            name for name in chosen.names if chosen.family.get(name) == family
        ]  # as good as those with more weight
        found.append(MissingFamily(family, tuple(dict.fromkeys((*laws, *own))), share, chance))
    return tuple(sorted(found, key=lambda one: -one.share))


def _laws(
    contest: Contest, family: str, weights: Mapping[tuple[str, ...], float]
) -> tuple[tuple[str, ...], float]:
    """Laws of a family by the weight of the hypotheses that hold them, and the weight of those that hold any."""
    by_name: dict[str, float] = {}
    held = 0.0
    for one in contest.hypotheses:
        laws = {name for name in one.names if one.family.get(name) == family}
        weight = weights.get(one.key, 0.0)
        held += weight if laws else 0.0
        for name in laws:
            by_name[name] = by_name.get(name, 0.0) + weight
    ranked = sorted(by_name, key=lambda name: -by_name[name])
    return tuple(name for name in ranked if by_name[name] >= LISTED), min(held, 1.0)
