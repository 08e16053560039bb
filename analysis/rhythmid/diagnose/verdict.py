"""The verdict: consistent, missing physics, unknown physics or undecided."""

import math
from collections.abc import Mapping
from dataclasses import dataclass

from scipy.stats import t as student

from rhythmid.diagnose.constants import EQUIVALENT, FALSE_ALARM, LEFT, STATED
from rhythmid.diagnose.evidence import chance_better, difference, gain_ahead, removed, weight_for
from rhythmid.diagnose.family import MissingFamily, families_of
from rhythmid.diagnose.hypothesis import Hypothesis, Prediction, Verdict
from rhythmid.diagnose.probability import Names
from rhythmid.diagnose.rejections import FEW, decisive, keeps_shape
from rhythmid.diagnose.selection import Contest, Selection, equivalent
from rhythmid.diagnose.verdict_rules import Outcome, rule_for
from rhythmid.simulation.transport import INPUT_DELAY

NOT_GRANTED = "{} effects that are not established ({})"


@dataclass(frozen=True)
class Unexplained:
    """What the chosen hypothesis leaves and a free map or a richer hypothesis predicts.

    Attributes
    ----------
    share : share of the explainable mismatch.
    significant : whether it is more than chance.
    goes_with : the quantity of the free map that predicts it best.
    expected : the largest share of all, significant or not, each multiplied by the chance that it is real.
    least : mean square that it removes at least, `EQUIVALENT` standard errors below the estimate.
    further : the effects that predict it beside the chosen ones, where these predict it best and not a free map; they were not
        accepted.
    """

    share: float
    significant: bool
    goes_with: str | None
    expected: float = 0.0
    least: float = 0.0
    further: tuple[str, ...] = ()


@dataclass(frozen=True)
class Decision:
    """The decision that follows from the evidence.

    Parameters
    ----------
    verdict, reason : the verdict, and the reason in words.
    rule : name of the verdict rule that applied.
    named : labels of the stated effects, by share; where none is stated, of those that come nearest.
    shares : share of the mismatch that each effect explains, by label.
    probability : probability of each effect, by label.
    joint : joint probability of all `named`.
    weights : weight of each hypothesis, by its key.
    equivalent : groups of names that the evidence does not separate, the chosen one first; of `named` only.
    unexplained : what is left.
    beside : names of further effects of the chosen model that are too uncertain to be stated.
    families : families of the chosen hypothesis' effects, where the verdict tells them.
    agreed : labels of the chosen effects whose names nearly all of the evidence contains, whatever stands beside them.
    """

    verdict: Verdict
    reason: str
    rule: str
    named: tuple[str, ...]
    shares: dict[str, float]
    probability: dict[str, float]
    joint: float
    weights: Mapping[tuple[str, ...], float]
    equivalent: tuple[tuple[str, ...], ...]
    unexplained: Unexplained
    beside: tuple[str, ...] = ()
    families: tuple[MissingFamily, ...] = ()
    agreed: tuple[str, ...] = ()


def unexplained(contest: Contest, chosen: Hypothesis) -> Unexplained:
    """The remainder beside a hypothesis: what free maps predict, or hypotheses with more effects that were not accepted."""
    whole = contest.mismatch
    rivals = [(quantity, (), one, len(contest.maps)) for quantity, one in contest.maps.items()]
    rivals += [
        (
            "",
            tuple(name for name in one.names if name not in chosen.names),
            one.prediction,
            contest.candidates,
        )
        for one in contest.hypotheses
        if len(one.elements) > len(chosen.elements) and one.kind == "effects"
    ]
    found: list[tuple[float, str, tuple[str, ...], float]] = []
    expected = 0.0
    for quantity, further, one, count in rivals:
        gain, error = difference(one, chosen.prediction)
        less, uncertain = removed(one, chosen.prediction)
        expected = max(expected, less * chance_better(one, chosen.prediction, decisive(count)))
        ahead = gain_ahead(one, chosen.prediction) >= -EQUIVALENT
        if less > 0.0 and ahead and 0.0 < significance(one, count) * error < gain:
            found.append((less, quantity, further, less - EQUIVALENT * uncertain))
    if whole <= 0.0:
        return Unexplained(0.0, False, None)
    expected = float(min(expected / whole, 1.0))
    if not found:
        return Unexplained(0.0, False, None, expected)
    less, quantity, further, least = max(found)
    if further:
        beside = any(set(one.names) == {*chosen.names, *further} for one in contest.hypotheses)
        kind = "further" if beside else "other"  # in addition to the chosen effects, or in their place
        quantity = NOT_GRANTED.format(kind, ", ".join(further).replace("_", " "))
    return Unexplained(float(min(less / whole, 1.0)), True, quantity, expected, max(least, 0.0), further)


def significance(prediction: Prediction, candidates: int) -> float:
    """Standard errors that the best of so many rivals has to gain, by Student's t over the blocks.

    A remainder must show all over the records; otherwise it does not contradict the names.
    """
    blocks = len(prediction.log_density)
    return float(student.isf(FALSE_ALARM / max(candidates, 1), max(blocks - 1, 1)))


def shares_of(contest: Contest, chosen: Hypothesis) -> dict[str, float]:
    """Share of the explainable mismatch that each effect of a hypothesis removes, by label.

    It is what the effect removes when it is added last or, if that is larger, the mean of this and of what it removes when it is
    added first. For two effects the mean is the Shapley value (L. S. Shapley, Contributions to the Theory of Games 2 (1953) 307).
    Effects may replace one another, so that neither removes much when added last; or mask one another, so that neither removes
    much when added first.
    """
    nominal, after = contest.nominal.prediction.mean_square, chosen.prediction.mean_square
    whole = contest.mismatch
    squares = {one.key: one.prediction.mean_square for one in contest.hypotheses}
    found = {}
    for label in chosen.elements:
        rest = set(chosen.elements) - {label}
        # the best of the fitted models without this effect
        without = min(square for key, square in squares.items() if set(key) <= rest)
        last = without - after
        first = nominal - squares[label,] if rest and (label,) in squares else last
        share = max(last, 0.5 * (last + first)) / whole if whole > 0.0 else 0.0
        found[label] = float(min(max(share, 0.0), 1.0))
    return found


def withheld(contest: Contest, selection: Selection) -> float:
    """Largest rms that one effect removes from the nominal model's error though it is not accepted, for too few blocks of data and nothing else.

    As the only candidate it would be accepted: its odds are decisive, but not among all that were tried.
    """
    reasons: dict[tuple[str, ...], list[str]] = {}
    for row in selection.rejections:
        reasons.setdefault(row.hypothesis, []).append(row.reason)
    nominal = contest.nominal.prediction
    removed_by_one = [
        nominal.mean_square - one.prediction.mean_square
        for one in contest.of_size(1)
        if one.kind == "effects"
        and reasons.get(one.elements) == [FEW]
        and weight_for(one.prediction, nominal) >= decisive(1)
    ]
    return math.sqrt(max(removed_by_one, default=0.0))


def lost_share(contest: Contest, chosen: Hypothesis) -> float:
    """Predictable share of the mismatch that a hypothesis leaves, beyond what models of real machines leave.

    An error that follows from its own past is not noise. It counts as unexplained, like the part that a free map predicts, although
    nothing that was tried predicts it.
    """
    whole = contest.mismatch
    structured = contest.structured_after**2 * chosen.prediction.mean_square
    beyond = structured - (LEFT * contest.size) ** 2
    return float(min(max(beyond, 0.0) / whole, 1.0)) if whole > 0.0 else 0.0


def _groups(contest: Contest, selection: Selection) -> tuple[tuple[str, ...], ...]:
    """Groups of names that can replace one another in hypotheses that predict as well as the chosen one."""
    chosen = selection.chosen
    groups = []
    for label, name in zip(chosen.elements, chosen.names):
        rest = set(chosen.elements) - {label}
        others = [
            dict(zip(one.elements, one.names))[(set(one.elements) - rest).pop()]
            for one in contest.hypotheses
            if one.kind == "effects"
            and len(one.elements) == len(chosen.elements)
            and rest < set(one.elements)
            and one.key != chosen.key
            and keeps_shape(one.shape)
            and equivalent(one, chosen, contest)
        ]
        if others:
            groups.append((name, *dict.fromkeys(others)))
    return tuple(groups)


def decide(
    contest: Contest, selection: Selection, detectable: float, size_errors: Mapping[str, float]
) -> Decision:
    """The decision on a selection.

    Parameters
    contest, selection : all hypotheses, and the chosen one.
    detectable : the smallest detectable effect, as a share of the motion or of the effort.
    size_errors : relative standard deviations of the chosen effects' sizes, by label; see `size_errors`.
    """
    chosen = selection.chosen
    left = unexplained(contest, chosen)
    shares = shares_of(contest, chosen)
    lost = left.expected + lost_share(contest, chosen)
    names = Names.of(contest, selection, _to_name(chosen, shares), shares, lost, size_errors)
    labels, stated = names.labels, names.stated
    groups = _groups(contest, selection)
    missed = math.sqrt(chosen.prediction.mean_square) / max(contest.size, 1e-300)
    important = max(contest.unnamed * contest.size, 1e-300)
    found = Outcome(
        kind=chosen.kind if chosen.elements else "nominal",
        stated=len(stated),
        delay_alone=chosen.kind == "delay" and (not stated or stated == (INPUT_DELAY,)),
        value_alone=chosen.kind == "freed_value" and not (stated and stated[0] in chosen.effects),
        left=left.share,
        goes_with=left.goes_with,
        remainder=math.sqrt(left.least) / important,
        missed=missed,
        structured=contest.structured * missed,
        lost=contest.structured_after * missed,
        astray=(chosen.heldout_nrmse or 0.0) / contest.follows,
        detectable=detectable,
        vague=size_errors.get(labels[0], 0.0) if labels else 0.0,
        evidence=names.evidence_for(labels),
        alike=bool(groups),
        cut_short=contest.cut_short,
        withheld=withheld(contest, selection) / important,
        uncompared=contest.uncompared,
    )
    rule = rule_for(found)
    named = stated if rule.verdict == "missing_physics" else labels
    told = {names.name(label) for label in named}
    effects = [label for label in labels if label in chosen.effects]
    return Decision(
        verdict=rule.verdict,
        reason=rule.reason_of(found),
        rule=rule.name,
        named=named,
        shares=shares,
        probability={label: names.probability([label]) for label in labels},
        joint=names.probability(stated or labels),
        weights=names.weights,
        equivalent=tuple(group for group in groups if group[0] in told),
        unexplained=left,
        beside=tuple(names.name(label) for label in effects if label not in named),
        families=families_of(names, shares, lost, size_errors) if rule.tells_family else (),
        agreed=tuple(label for label in effects if names.evidence_for([label]) >= STATED),
    )


def _to_name(chosen: Hypothesis, shares: Mapping[str, float]) -> tuple[str, ...]:
    """Labels of the chosen effects that an answer may name, the largest share first."""
    labels = tuple(sorted(chosen.elements, key=lambda label: -round(shares[label], 6)))
    if chosen.kind == "free_map":  # a map is not a name
        labels = tuple(label for label in labels if label != chosen.elements[-1])
    if chosen.kind == "delay" and chosen.effects:  # a delay beside effects is reported with the delays
        labels = tuple(label for label in labels if label != INPUT_DELAY)
    return labels
