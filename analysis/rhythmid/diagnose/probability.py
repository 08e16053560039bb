"""Probabilities of names: how much of the evidence is for hypotheses that hold them.

Hypotheses with no more effects than the chosen one share the evidence, as pseudo-BMA weights. A name's probability is the
share of those that hold it, times the chance that the catalogue holds the truth at all. That falls with how much is left that
something else explains, beside the part of the mismatch that the name explains; with how little worse the nearest other name
predicts; and with how little the records determine the effect's size. For the laws of the catalogue are a sample of all laws:
where the records hardly tell two of them apart, they would not tell the chosen one from one that the catalogue lacks. And where an
effect improves the prediction by much, whatever its size is, it does so in a limit that other laws have as well.
"""

import math
from collections.abc import Sequence

import numpy as np

from rhythmid.diagnose.constants import ADEQUATE, ALIKE, SHARPNESS, STEEPNESS, VAGUE, VAGUENESS
from rhythmid.diagnose.evidence import probabilities
from rhythmid.diagnose.hypothesis import Hypothesis
from rhythmid.diagnose.rejections import keeps_shape
from rhythmid.diagnose.selection import Contest, Selection, equivalent


def weights_of(contest: Contest, selection: Selection) -> dict[tuple[str, ...], float]:
    """Weight of each hypothesis, by its key, among those with no more effects than the chosen one."""
    most = len(selection.chosen.elements)
    rivals = [one for one in contest.hypotheses if len(one.elements) <= most and keeps_shape(one.shape)]
    return {one.key: float(weight) for one, weight in zip(rivals, probabilities(rivals))}


def adequacy(explained: float) -> float:
    """Chance that names which explain this share of what anything explains are the true ones.

    A logistic function of the logarithm of what they leave.
    """
    left = min(max(1.0 - explained, 1e-9), 1.0)
    return float(1.0 / (1.0 + (left / ADEQUATE) ** STEEPNESS))


def told_apart(margin: float) -> float:
    """Chance that a name is not only the nearest to a law that the catalogue lacks, where the nearest other name predicts worse by
    this log density: a logistic function of its logarithm."""
    return float(1.0 / (1.0 + (ALIKE / max(margin, 1e-9)) ** SHARPNESS))


def resolved(error: float) -> float:
    """Chance that an effect is not only a limit of its law, where its size has this standard deviation relative to itself: a logistic
    function of its logarithm."""
    return float(1.0 / (1.0 + (error / VAGUE) ** VAGUENESS)) if error < math.inf else 0.0


def margin_over_others(label: str, contest: Contest, selection: Selection) -> float:
    """By how much log density the chosen hypothesis, or one with a richer law in its place, predicts better than the best rival.

    Rivals have no more effects, and neither the effect of this label nor one that contains it or is a special case of it: nested
    laws are always near. What is equivalent is listed with the name.
    """
    chosen = selection.chosen
    name = dict(zip(chosen.elements, chosen.names))[label]
    accepted = {name, *chosen.richer.get(name, ())}
    others = [
        one.prediction.score
        for one in contest.hypotheses
        if len(one.elements) <= len(chosen.elements)
        and not accepted & set(one.names)
        and not any(name in richer for richer in one.richer.values())
        and keeps_shape(one.shape)
        and not equivalent(one, chosen, contest)
    ]
    own = [
        one.prediction.score
        for one in contest.hypotheses
        if len(one.elements) == len(chosen.elements) and accepted & set(one.names)
    ]
    return max(own) - max(others, default=-math.inf)


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
