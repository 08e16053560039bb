"""Families: the kind of missing physics, which the records may determine where they do not determine the law.

Coulomb friction, Stribeck friction and hysteresis are laws of one family. Several of them may predict about as well, or each may
leave a small mismatch that the true law would not. Then each name is uncertain, but the family is not.
"""

from collections.abc import Mapping
from dataclasses import dataclass

from rhythmid.diagnose.probability import Names, chance_beside, chance_of_law
from rhythmid.diagnose.selection import Contest

LISTED = 0.01  # weight from which a law is listed: about the accuracy of a weight by the Bayesian bootstrap, see `DRAWS`


@dataclass(frozen=True)
class MissingFamily:
    """A family of the catalogue of which the model lacks a law.

    Parameters
    ----------
    family : its name.
    laws : names of its laws that the evidence leaves open, the largest weight first; they include the chosen ones.
    share : share of the mismatch on held-out data that the laws of the chosen hypothesis explain.
    probability : probability that the truth contains a law of this family.
    """

    family: str
    laws: tuple[str, ...]
    share: float
    probability: float


def families_of(
    names: Names, shares: Mapping[str, float], left: float, size_errors: Mapping[str, float]
) -> tuple[MissingFamily, ...]:
    """Families of the chosen hypothesis' effects, the one with the largest share first.

    Parameters
    ----------
    names : its effects, and how probable their names are. What an effect of another family removes may be due to this family.
    shares : shares of the mismatch that the effects explain, by label.
    left : share of the mismatch that the chosen hypothesis is expected to leave.
    size_errors : relative standard deviations of the effects' sizes, by label. For a family that of its effect with the largest
        share counts: an effect at a limit of its law may also be a law of another family.
    """
    chosen = names.chosen
    labels: dict[str, list[str]] = {}
    for label, name in zip(chosen.elements, chosen.names):
        if chosen.family.get(name):
            labels.setdefault(chosen.family[name], []).append(label)
    found = []
    for family, mine in labels.items():
        share = min(sum(shares[label] for label in mine), 1.0)
        others = [one for label, one in names.in_place.items() if label not in mine]
        laws, held = _laws(names.contest, family, names.weights)
        vague = size_errors.get(max(mine, key=lambda label: shares[label]), 0.0)

        def chance(rest: float, family: str = family, share: float = share, vague: float = vague) -> float:
            return chance_of_law(share, rest, vague, family)

        # laws that predict as well as those with more weight
        own = [name for name in chosen.names if chosen.family.get(name) == family]
        found.append(
            MissingFamily(
                family, tuple(dict.fromkeys((*laws, *own))), share, chance_beside(others, chance, left) * held
            )
        )
    return tuple(sorted(found, key=lambda one: -one.share))


def _laws(
    contest: Contest, family: str, weights: Mapping[tuple[str, ...], float]
) -> tuple[tuple[str, ...], float]:
    """Laws of a family, sorted by the weight of the hypotheses that contain them, and the weight of those that contain any."""
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
