"""Rejections: all reasons for not believing a hypothesis, one row each of one table.

A row has a statistic, and rejects where the statistic is below its threshold. All rows are evaluated for every hypothesis, and all
rejections are reported. `python -m rhythmid.diagnose.rejections` prints the table as Markdown.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from rhythmid.diagnose.constants import (
    BLOCK_ODDS,
    EDGE,
    EQUIVALENT,
    FALSE_ALARM,
    MAINLY,
    MISMATCH,
    REST,
    RICHER,
)
from rhythmid.diagnose.evidence import gain_ahead, weight_for
from rhythmid.diagnose.hypothesis import Hypothesis, special_case


@dataclass(frozen=True)
class Claim:
    """A hypothesis, and the hypotheses with which it is compared.

    Parameters
    ----------
    hypothesis : the hypothesis.
    without : the hypothesis with one effect less that predicts best. Related laws compete for one place, so it need not be a
        part of this one.
    nominal : the refitted nominal model.
    floor : mean squared error of the best prediction of all, free maps included.
    candidates : number of effects tried for this place.
    size : rms of the signal that errors are a share of.
    practical : share of `size` below which an effect has no practical importance.
    simpler : a simpler hypothesis with as many effects, or one that this one contains, which it would replace.
    """

    hypothesis: Hypothesis
    without: Hypothesis
    nominal: Hypothesis
    floor: float
    candidates: int
    size: float
    practical: float
    simpler: Hypothesis | None = None

    @property
    def removed(self) -> float:
        """Mean squared error that the last effect removes."""
        return self.without.prediction.mean_square - self.hypothesis.prediction.mean_square


@dataclass(frozen=True)
class Rule:
    """One row: it rejects a claim whose `statistic` is below its `threshold`.

    `reason` states why. Where there are several possible reasons it lists all of them, and `why` gives the one for a claim.
    """

    name: str
    says: str
    reason: str
    statistic: Callable[[Claim], float]
    threshold: Callable[[Claim], float]
    why: Callable[[Claim], str] | None = None

    def reason_for(self, claim: Claim) -> str:
        """The reason for which this claim is rejected."""
        return self.reason if self.why is None else self.why(claim)


@dataclass(frozen=True)
class Rejection:
    """A hypothesis that a rule rejects."""

    hypothesis: tuple[str, ...]
    name: str
    statistic: float
    threshold: float
    reason: str


def decisive(candidates: int) -> float:
    """Logarithm of the odds that the best of so many candidates needs."""
    return math.log(max(candidates, 1) / FALSE_ALARM)


def _share(part: float, whole: float) -> float:
    return part / whole if whole > 0.0 else math.copysign(math.inf, part)


def _share_of_rest(claim: Claim) -> float:
    return _share(claim.removed, claim.without.prediction.mean_square - claim.floor)


def _share_of_mismatch(claim: Claim) -> float:
    return _share(claim.removed, claim.nominal.prediction.mean_square - claim.floor)


def _size(claim: Claim) -> float:
    return math.sqrt(max(claim.removed, 0.0)) / max(claim.size, 1e-300)


def _over_simpler(claim: Claim) -> float:
    if claim.simpler is None:
        return math.inf
    return weight_for(claim.hypothesis.prediction, claim.simpler.prediction)


def _needed_of_mismatch(claim: Claim) -> float:
    richer = claim.simpler is not None and special_case(claim.simpler, claim.hypothesis)
    return RICHER if richer else MISMATCH


AT_END = "within_bounds"  # the shape of a law whose parameters are inside its range
# lower limits of statistics of the fitted effects themselves; a hypothesis below one of them does not compete
SHAPES: Mapping[str, float] = {
    AT_END: EDGE,
    "moves_the_machine": MAINLY,
    "more_than_gain": MAINLY,
}


def keeps_shape(shape: Mapping[str, float]) -> bool:
    """Whether effects with these statistics still act as their names say."""
    return all(shape.get(name, math.inf) >= least for name, least in SHAPES.items())


def _shape_rule(name: str, says: str, reason: str) -> Rule:
    return Rule(
        name, says, reason, lambda claim: claim.hypothesis.shape.get(name, math.inf), lambda _: SHAPES[name]
    )


CHANCE = "a gain of this size is expected by chance among so many candidates"
HARM = "it harms some blocks of the records, so that too little of its gain in the others is left"
FEW = "its gain rests on too few blocks of the records"
INSTEAD = "other effects, one fewer, predict as well"


def _why_no_better(claim: Claim) -> str:
    """The reason for too little evidence: a rival, blocks with contrary evidence, too few blocks, or chance."""
    needed = decisive(claim.candidates)
    gain = claim.hypothesis.prediction.log_density - claim.without.prediction.log_density
    if not set(claim.without.elements) <= set(claim.hypothesis.elements) and gain.sum() < needed:
        return INSTEAD
    # a chance gain does not remove this share of the whole error, noise included
    large = claim.removed >= REST * claim.without.prediction.mean_square
    if large or gain.sum() >= needed:
        for_it = float(np.clip(gain, 0.0, math.log(BLOCK_ODDS)).sum())
        return HARM if for_it >= needed else FEW
    return CHANCE


RULES: tuple[Rule, ...] = (
    Rule(
        "predicts_better",
        "log odds against the best hypothesis with one effect less, of which no block of data brings more than 20 to 1",
        "; or ".join((CHANCE, INSTEAD, HARM, FEW)),
        lambda claim: weight_for(claim.hypothesis.prediction, claim.without.prediction),
        lambda claim: decisive(claim.candidates),
        _why_no_better,
    ),
    Rule(
        "predicts_ahead",
        "gain in predictive log density on the held-out ends and records alone, in its standard errors over blocks",
        "it does not predict the held-out data better",
        lambda claim: gain_ahead(claim.hypothesis.prediction, claim.without.prediction),
        lambda _: -EQUIVALENT,
    ),
    Rule(
        "share_of_rest",
        "squared error that the effect removes, as a share of what the best prediction of all, free maps included, would remove",
        "its share of the remainder is too small to distinguish it from other effects",
        _share_of_rest,
        lambda _: REST,
    ),
    Rule(
        "share_of_mismatch",
        "squared error that the effect removes, and a richer law beyond one that it contains, as a share of what the best prediction of all would "
        "remove from the nominal model's",
        "its share of the mismatch is not larger than what errors of the other effects may leave",
        _share_of_mismatch,
        _needed_of_mismatch,
    ),
    Rule(
        "practical_size",
        "rms that the effect removes, as a share of the motion or of the effort",
        "an effect of this size is of no practical importance",
        _size,
        lambda claim: claim.practical,
    ),
    Rule(
        "beats_simpler",
        "log odds against an explanation with as many effects that has fewer parameters, or that is a special case of it; no block "
        "of data brings more than 20 to 1",
        "a simpler explanation predicts as well",
        _over_simpler,
        lambda _: decisive(1),
    ),
    _shape_rule(
        AT_END,
        "distance of the effect's parameters from the bounds within which its name applies, as a share of the bound; and of its size from that "
        "of no effect, as a share of its first guess",
        "only a limit of its parameters is identifiable, where it is another effect",
    ),
    _shape_rule(
        "moves_the_machine",
        "share of the effort that an actuator's effect leaves to move the machine",
        "an actuator's effect that removes most of the effort cannot explain the motion",
    ),
    _shape_rule(
        "more_than_gain",
        "mean square of what an actuator's law does to the recorded effort beyond a gain, as a share of what it does to the effort that "
        "the model requires",
        "on the recorded effort it is mainly a gain, which inertia and forces contain already",
    ),
)


def rejections_of(claim: Claim, rules: Sequence[Rule] = RULES) -> list[Rejection]:
    """The rules that reject a claim, in the table's order."""
    found = []
    for rule in rules:
        statistic, threshold = rule.statistic(claim), rule.threshold(claim)
        if not statistic >= threshold:
            reason = rule.reason_for(claim)
            found.append(Rejection(claim.hypothesis.elements, rule.name, statistic, threshold, reason))
    return found


# rules that a hypothesis must pass to replace a simpler one, and to replace one that it contains
OVER_SIMPLER = tuple(rule for rule in RULES if rule.name == "beats_simpler")
OVER_CONTAINED = tuple(
    rule for rule in RULES if rule.name in ("beats_simpler", "share_of_rest", "share_of_mismatch")
)


def replaces(claim: Claim) -> bool:
    """Whether a richer law replaces one that it contains, given as `claim.without` and `claim.simpler`.

    It must predict better. Of the simpler law's remainder above the floor, and of the whole mismatch, it must remove more than
    small effects do.
    """
    return not rejections_of(claim, OVER_CONTAINED)


def table() -> str:
    """The rules as a Markdown table."""
    rows = ["| name | statistic | rejects because |", "| --- | --- | --- |"]
    rows += [f"| `{rule.name}` | {rule.says} | {rule.reason} |" for rule in RULES]
    return "\n".join(rows)


if __name__ == "__main__":
    print(table())
