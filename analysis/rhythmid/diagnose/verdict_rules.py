"""Verdict rules: one row each of one table; the first row that applies to the evidence gives verdict and reason.

A row has a statistic, and applies where the statistic is above its threshold. `python -m rhythmid.diagnose.verdict_rules` prints the
table as Markdown.
"""

import re
from collections.abc import Callable
from dataclasses import dataclass

from rhythmid.diagnose.constants import (
    BLIND,
    EXPLAINED_BY_NAMES,
    LEFT,
    MAINLY,
    PRACTICAL,
    STATED,
    UNNAMED_EFFORT,
    VAGUE,
)
from rhythmid.diagnose.hypothesis import Kind, Verdict

LONGER_DELAY = "longer_delay"


@dataclass(frozen=True)
class Outcome:
    """The quantities on which a verdict depends.

    Parameters
    ----------
    kind : kind of the chosen hypothesis; "nominal" where nothing was added.
    stated : number of its effects, those with the largest shares first, that are jointly probable enough to be stated.
    delay_alone : whether the hypothesis is a longer delay and none of its effects is stated.
    value_alone : whether the hypothesis frees a value, and no stated effect has the largest share.
    left : share of the mismatch that the hypothesis leaves and something else predicts.
    goes_with : the quantity that this remainder depends on.
    remainder : lower limit of the rms of the significant remainder, relative to the smallest size of practical importance.
    missed : rms error of the chosen hypothesis, as a share of the measurement.
    structured : the part of `missed` that is predictable from its own past, hence not noise; with the share of the nominal model.
    lost : the same with the share of the model with which the search ended.
    astray : its error on held-out data, relative to that up to which a model follows the machine.
    detectable : smallest detectable effect, as a share of the motion or of the effort.
    vague : relative standard deviation of the size of the effect with the largest share.
    evidence : share of the evidence held by hypotheses that contain all of its names.
    alike : whether other names predict as well in place of one of them.
    cut_short : whether the budget ended the search before all effects that scored well were tried.
    withheld : rms that one effect removes though it is not accepted, because its gain rests on too few blocks, relative to the smallest size
        of practical importance.
    uncompared : whether the budget ended before the other kinds of explanation, and related laws, were compared.
    """

    kind: Kind
    stated: int
    delay_alone: bool
    value_alone: bool
    left: float
    goes_with: str | None
    remainder: float
    missed: float
    structured: float
    lost: float
    astray: float
    detectable: float
    vague: float
    evidence: float
    alike: bool
    cut_short: bool = False
    withheld: float = 0.0
    uncompared: bool = False


@dataclass(frozen=True)
class VerdictRule:
    """One row: it applies to an outcome whose `statistic` is above the `threshold`; fields of the outcome are inserted into `reason`.

    `tells_family`: whether the answer gives the families of the effects with their probabilities, although it may state no name.
    """

    name: str
    says: str
    threshold: float
    verdict: Verdict
    reason: str
    statistic: Callable[[Outcome], float]
    tells_family: bool = False

    def reason_of(self, found: Outcome) -> str:
        """The reason in words and figures."""
        return self.reason.format(
            goes_with=found.goes_with,
            left=100.0 * found.left,
            missed=_per_cent(found.missed),
            structured=100.0 * found.structured,
            lost=_per_cent(found.lost),
            detectable=100.0 * found.detectable,
        )


def _per_cent(share: float) -> str:
    """A share in per cent; an error may be many times what was measured, and how many times says nothing."""
    value = 100.0 * share
    if value > 100.0:
        return "more than 100"
    return f"{value:.0f}" if value >= 10.0 else f"{value:.2g}"


def _alone(statistic: Callable[[Outcome], float]) -> Callable[[Outcome], float]:
    """The statistic if nothing was added to the nominal model, else 0."""
    return lambda found: statistic(found) if found.kind == "nominal" else 0.0


def _is(kind: Kind) -> Callable[[Outcome], float]:
    return lambda found: float(found.kind == kind)


def _of_search(statistic: Callable[[Outcome], float], cut_short: bool) -> Callable[[Outcome], float]:
    """The statistic if the search was cut short, or was not, as `cut_short` says; else 0."""
    return lambda found: statistic(found) if found.cut_short is cut_short else 0.0


VERDICT_RULES: tuple[VerdictRule, ...] = (
    VerdictRule(
        "lost",
        "the autocorrelated part of the error of the chosen hypothesis, as a share of what was measured",
        MAINLY,
        "undecided",
        "with every effect that was tried the model misses {missed} % of what was measured; {lost} points of this error are autocorrelated, hence not "
        "noise: something that was not recorded may act, or units, signs or the structure of the model are wrong",
        lambda found: found.lost,
    ),
    VerdictRule(
        "none_yet",
        "no effect is accepted, and the budget ended the search: the statistic of `unnamed_remainder`",
        1.0,
        "undecided",
        "the budget ended the search, and an effect that was not tried may explain the mismatch, which depends on {goes_with}",
        _of_search(_alone(lambda found: found.remainder), True),
    ),
    VerdictRule(
        "not_searched",
        "no effect is accepted, and the budget ended the search: the autocorrelated part of the error of the refitted nominal model, as a share of what "
        "was measured",
        PRACTICAL,
        "undecided",
        "the budget ended the search; {structured:.2g} % of what was measured is missed by the refitted nominal model and is autocorrelated, hence not noise, "
        "and not all effects that may explain it were tried",
        _of_search(_alone(lambda found: found.structured), True),
    ),
    VerdictRule(
        "unnamed_remainder",
        "no effect is accepted: rms that a free function or further effects predict beyond chance, two standard errors below its estimate, divided by "
        f"that of practical importance, {100 * PRACTICAL:g} % of the motion or {100 * UNNAMED_EFFORT:g} % of the effort",
        1.0,
        "unknown_physics",
        "no effect of the catalogue explains the mismatch, which depends on {goes_with}",
        _alone(lambda found: found.remainder),
    ),
    VerdictRule(
        "missed",
        "no effect is accepted: error of the refitted nominal model, as a share of what was measured",
        BLIND,
        "undecided",
        "the refitted nominal model misses {missed} % of what was measured, and nothing that was tried explains it",
        _alone(lambda found: found.missed),
    ),
    VerdictRule(
        "structured",
        "no effect is accepted: the autocorrelated part of the error of the refitted nominal model, as a share of what was measured",
        LEFT,
        "undecided",
        "the refitted nominal model misses {missed} % of what was measured; {structured:.0f} points of this error are autocorrelated, hence not noise, "
        "and no effect that was tried explains it",
        _alone(lambda found: found.structured),
    ),
    VerdictRule(
        "blind",
        "no effect is accepted: smallest effect that the records would show, as a share of what was measured",
        BLIND,
        "undecided",
        "these records would not show an effect below {detectable:.0f} % of what was measured",
        _alone(lambda found: found.detectable),
    ),
    VerdictRule(
        "few_blocks",
        "no effect is accepted: rms that one effect removes whose gain rests on too few blocks, divided by that of practical importance (as for "
        "`unnamed_remainder`)",
        1.0,
        "undecided",
        "the refitted nominal model misses {missed} % of what was measured; an effect that would remove a good part of it is not established, because "
        "its gain rests on too few blocks of the records",
        _alone(lambda found: found.withheld),
    ),
    VerdictRule("nothing_missing", "no effect is accepted (1)", 0.0, "consistent", "", _alone(lambda _: 1.0)),
    VerdictRule(
        "freed_value",
        "a value that the file holds fixed is set free, and no effect that is stated has a larger share (1)",
        0.0,
        "undecided",
        "a value that the nominal model holds fixed explains the records when it is free",
        lambda found: float(found.value_alone),
        tells_family=True,
    ),
    VerdictRule(
        LONGER_DELAY,
        "the chosen hypothesis has a longer delay, and no effect beside it can be stated (1)",
        0.0,
        "undecided",
        "a longer delay of the input than was given explains the records",
        lambda found: float(found.delay_alone),
    ),
    VerdictRule(
        "one_law",
        "a free function in the place of several effects is chosen (1)",
        0.0,
        "unknown_physics",
        "a free map explains the records as well as several names together",
        _is("free_map"),
    ),
    VerdictRule(
        "other_place",
        "an effect in a slot of the signal path where the catalogue has no such element is chosen (1)",
        0.0,
        "undecided",
        "the effect explains the records best in a slot for which the catalogue has no such element",
        _is("location"),
    ),
    VerdictRule(
        "astray",
        "error of the chosen hypothesis on the held-out motion, divided by that up to which a model follows the machine",
        1.0,
        "undecided",
        "the model does not follow the held-out motion with these effects either",
        lambda found: found.astray,
    ),
    VerdictRule(
        "uncompared",
        "the budget ended before the other kinds of explanation and the related laws were compared (1)",
        0.0,
        "undecided",
        "the budget ended before freed values, longer delays, other places, free functions and related laws were compared, and one of them may "
        "explain the records as well",
        lambda found: float(found.uncompared),
        tells_family=True,
    ),
    VerdictRule(
        "stated",
        f"number of effects, those with the largest shares first, whose joint probability is at least {STATED:g}",
        0.0,
        "missing_physics",
        "",
        lambda found: float(found.stated),
        tells_family=True,
    ),
    VerdictRule(
        "partly_left",
        "share of the mismatch that the effects leave and something else predicts, where the budget did not end the search",
        1.0 - EXPLAINED_BY_NAMES,
        "unknown_physics",
        "the named effects leave {left:.0f} % of the mismatch, which depends on {goes_with}",
        _of_search(lambda found: found.left, False),
    ),
    VerdictRule(
        "rivals",
        "share of the evidence for hypotheses that lack one of the names; 1 where the model with another name in its place predicts as well",
        1.0 - STATED,
        "undecided",
        "the evidence does not separate several explanations",
        lambda found: 1.0 if found.alike else 1.0 - found.evidence,
        tells_family=True,
    ),
    VerdictRule(
        "size_open",
        "standard deviation of the size of the effect with the largest share, relative to the size",
        VAGUE,
        "undecided",
        "the records do not determine the size of the effect that explains most, so it may stand for a law that the catalogue lacks",
        lambda found: found.vague,
        tells_family=True,
    ),
    VerdictRule(
        "too_uncertain",
        "none of the above (1)",
        0.0,
        "undecided",
        "what may be left of the mismatch is too large for the names to be stated, so the true law may be one that the catalogue lacks",
        lambda _: 1.0,
        tells_family=True,
    ),
)


def rule_for(found: Outcome) -> VerdictRule:
    """The first row that applies."""
    return next(rule for rule in VERDICT_RULES if rule.statistic(found) > rule.threshold)


def table() -> str:
    """The rules as a Markdown table."""
    rows = [
        "| name | statistic | above | verdict | states families | because |",
        "| --- | --- | --- | --- | --- | --- |",
    ]
    rows += [
        f"| `{rule.name}` | {rule.says} | {rule.threshold:.3g} | `{rule.verdict}` | {'yes' if rule.tells_family else ''} | "
        f"{_words(rule.reason)} |"
        for rule in VERDICT_RULES
    ]
    return "\n".join(rows)


def _words(reason: str) -> str:
    """A reason with an ellipsis for each figure."""
    return re.sub(r"\{.*?\}", "…", reason)


if __name__ == "__main__":
    print(table())
