"""Print a diagnosis: the verdict first, then names, hypotheses, the remainder, and the rejected hypotheses."""

from collections.abc import Sequence
from dataclasses import asdict

from rich.console import Console
from rich.markup import escape

from rhythmid.diagnose.answer.result import Diagnosis, Explanation, Scored
from rhythmid.diagnose.rejections import Rejection
from rhythmid.report.hypotheses import grouped, interchangeable, most_weighed
from rhythmid.report.quantity import (
    NONE,
    RARE,
    averaged_words,
    number,
    remaining_error,
    with_std,
    written_percent,
)
from rhythmid.report.terminal_table import print_estimates, print_table

HYPOTHESES_SHOWN = 6
REJECTIONS_SHOWN = 5
NOMINAL = "nominal model"


def show(found: Diagnosis, console: Console) -> None:
    """Print a diagnosis."""

    def told(label: str, text: str) -> None:
        console.print(f"[bold]{escape(label)}[/]: {escape(text)}")

    def said(label: str, text: str) -> None:
        console.print(f"{escape(label)}: {escape(text)}")

    told(found.verdict.replace("_", " "), found.summary)
    said("where", found.location.where)
    for effect in found.missing:
        sizes = f"{written_percent(effect.share)} of the mismatch"
        if found.verdict == "missing_physics":  # with other verdicts the answer does not state the name
            sizes = f"probability {_probability(effect.probability)}, {sizes}"
        told(effect.element, f"{effect.equation}   ({sizes})")
        sizes_of = {
            name: asdict(one) if one.std is not None else asdict(one) | {"value": None}
            for name, one in effect.parameters.items()
        }
        print_estimates(console, "", sizes_of, "parameter")
    for family in found.families if found.verdict == "undecided" else ():
        sizes = (
            f"probability {_probability(family.probability)}, {written_percent(family.share)} of the mismatch"
        )
        said(f"some form of {family.family}", f"{sizes}: {', '.join(family.laws)}")
    if len(found.missing) > 1 and found.verdict == "missing_physics":
        said("joint probability of these names", _probability(found.joint_probability))
    for group in found.indistinguishable:
        said("indistinguishable here", ", ".join(group))
    if len(found.hypotheses) > 1:
        _print_hypotheses(found, console)
    said("remainder", remainder_words(found))
    said("scored", scoring_words(found.scoring))
    for name, fit in found.fit.items():
        if name == "augmented" and fit == found.refitted_nominal:
            continue  # the same model as the refitted nominal one
        held = number(fit.heldout_nrmse, 3)
        of = averaged_words(found.scoring.averaged)
        said(
            name.replace("_", " "), f"NRMSE{of} {number(fit.train_nrmse, 3)} on fitted data, {held} held out"
        )
    for label, group in (
        ("assumption", found.assumptions),
        ("calibration", found.calibration),
        ("not tried", grouped([(one.name, one.reason) for one in found.excluded])),
        ("note", found.notes),
    ):
        for line in group:
            said(label, line)
    for line in rejection_words(told_rejections(found)):
        said("rejected", line)
    said("next experiment", found.next_experiment)


def _print_hypotheses(found: Diagnosis, console: Console) -> None:
    shown = [
        one
        for place, one in enumerate(found.hypotheses)
        if place < HYPOTHESES_SHOWN or _is_chosen(found, one)
    ]
    best = min(len(found.hypotheses), HYPOTHESES_SHOWN)
    weighed = most_weighed([(one.elements, one.probability) for one in found.hypotheses])
    figures = ("worse by", "weight of evidence", "held-out error")
    rows = []
    for one in shown:
        behind = "best" if one.score_difference == 0.0 else _worse(one.score_difference, one.standard_error)
        weight = f"{one.probability:.2f}" if len(one.elements) <= weighed else NONE
        name = (" + ".join(one.elements) or NOMINAL) + (" (chosen)" if _is_chosen(found, one) else "")
        rows.append((name, one.kind.replace("_", " "), behind, weight, written_percent(one.heldout_nrmse)))
    print_table(
        console,
        f"the {best} best of {len(found.hypotheses)} hypotheses{', and the chosen one' if len(shown) > best else ''}, "
        "by their predictions of unseen data",
        ("hypothesis", "kind", *figures),
        rows,
        right=figures,
    )


def _is_chosen(found: Diagnosis, one: Explanation) -> bool:
    """Whether a hypothesis is the one that the answer is based on."""
    return sorted(one.elements) == sorted(found.chosen)


def remainder_words(found: Diagnosis) -> str:
    """The remainder in words: as a share of the mismatch; where nothing is missing there is no mismatch, and it is told by the error."""
    left = found.remainder
    if not left.significant:
        return "nothing that any free function predicts better than chance"
    if found.verdict == "consistent":
        return f"{remaining_error(found.refitted_nominal.error, found.scoring.kind)}, part of which depends on {left.goes_with}"
    return f"{written_percent(left.share)} of the mismatch, which depends on {left.goes_with}"


def scoring_words(scored: Scored) -> str:
    """How the records were scored and why, in words."""
    how = {"free_run": "in free run", "windows": "in windows", "effort": "by the recorded effort"}[
        scored.kind
    ]
    below = "" if scored.bandwidth is None else f" below {scored.bandwidth:.3g} Hz"
    return f"{how}{below}: {scored.reason}"


def told_rejections(found: Diagnosis) -> list[Rejection]:
    """The rejections in the order of the hypotheses.

    Hypotheses reported as indistinguishable from the chosen one are left out: they are rejected only because the chosen
    one is simpler.
    """
    rank = {tuple(sorted(one.elements)): place for place, one in enumerate(found.hypotheses)}
    against = [
        row
        for row in found.rejections
        if not interchangeable(row.hypothesis, found.chosen, found.indistinguishable)
    ]
    return sorted(against, key=lambda row: rank.get(tuple(sorted(row.hypothesis)), len(rank)))


def rejection_words(rejections: Sequence[Rejection]) -> list[str]:
    """The first rejected hypotheses, each with its first reason, and the number of further ones."""
    reasons: dict[tuple[str, ...], str] = {}
    for row in rejections:
        reasons.setdefault(row.hypothesis, row.reason)
    told = [
        f"{' + '.join(elements).replace('_', ' ')} ({why})"
        for elements, why in list(reasons.items())[:REJECTIONS_SHOWN]
    ]
    more = len(reasons) - len(told)
    if more > 0:
        told.append(f"and {more} more; --json and --report list all, with statistics and thresholds")
    return told


def _worse(difference: float, error: float) -> str:
    """A difference of log densities with its standard error, in whole numbers where it is large."""
    return f"{difference:.0f} ± {error:.0f}" if difference >= 10.0 else with_std(difference, error)


def _probability(value: float) -> str:
    """A probability; close to 0 or 1 only a bound is given, because evidence never reaches either."""
    if value < RARE:
        return f"< {100.0 * RARE:g} %"
    return f"> {100.0 * (1.0 - RARE):g} %" if value > 1.0 - RARE else written_percent(value)
