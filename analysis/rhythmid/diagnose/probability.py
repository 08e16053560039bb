"""Probabilities of names: how much of the evidence is for hypotheses that hold them.

Hypotheses with no more effects than the chosen one share the evidence, as pseudo-BMA weights. A name's probability is the
share of those that hold it, times the chance that the catalogue holds the truth at all, given how much is left that something
else explains, beside the part of the mismatch that the name explains.
"""

from collections.abc import Sequence

import numpy as np

from rhythmid.diagnose.constants import ADEQUATE, STEEPNESS
from rhythmid.diagnose.evidence import probabilities
from rhythmid.diagnose.hypothesis import Hypothesis
from rhythmid.diagnose.selection import Contest, Selection


def weights_of(contest: Contest, selection: Selection) -> dict[tuple[str, ...], float]:
    """Weight of each hypothesis, by its key, among those with no more effects than the chosen one."""
    most = len(selection.chosen.elements)
    rivals = [one for one in contest.hypotheses if len(one.elements) <= most and selection.sound(one)]
    return {one.key: float(weight) for one, weight in zip(rivals, probabilities(rivals))}


def adequacy(explained: float) -> float:
    """Chance that names which explain this share of what anything explains are the true ones.

    A logistic function of the logarithm of what they leave.
    """
    left = min(max(1.0 - explained, 1e-9), 1.0)
    return float(1.0 / (1.0 + (left / ADEQUATE) ** STEEPNESS))


def joint_probability(
    names: Sequence[str], contest: Contest, chosen: Hypothesis, weights: dict[tuple[str, ...], float]
) -> float:
    """Share of the evidence for hypotheses that hold all these names of the chosen one.

    A richer law that contains a name holds it, too: were it clearly better, it would have been chosen.
    """
    accepted = [{name, *chosen.richer.get(name, ())} for name in names]
    held = [
        weights.get(one.key, 0.0)
        for one in contest.hypotheses
        if all(group & set(one.names) for group in accepted)
    ]
    return float(np.clip(sum(held), 0.0, 1.0))
