"""All hypotheses by their evidence, and the reasons for the rejected ones."""

import math
from collections.abc import Mapping, Sequence
from typing import Any

from rhythmid.report.blocks import Block, Bullets, Drawing, Fold, Heading, Paragraph, Section, Table
from rhythmid.report.evidence_chart import Evidence, draw_evidence
from rhythmid.report.findings import Findings
from rhythmid.report.quantity import NONE, number, percent, plain, plus_minus, pretty_name
from rhythmid.report.row_chart import Bar, draw_bars

HYPOTHESES_SHOWN, REJECTIONS_SHOWN, SCORES_SHOWN = 12, 12, 12
AS_GOOD, REJECTED = "as good as the chosen one", "rejected, see below"  # verdicts on a hypothesis
LEAST_ODDS = math.log(40.0)  # difference of log density above which a simpler model is rejected
KINDS = {
    "nominal": "nothing is missing",
    "effects": "effects are missing",
    "freed_value": "a value held fixed is wrong",
    "delay": "the delay is longer",
    "location": "the effect is in another place",
    "free_map": "an unknown law",
}


def hypotheses_section(found: Findings) -> Section:
    """The hypotheses, the best first, and the score tests from which they came."""
    rows: Sequence[Mapping[str, Any]] = found.result["hypotheses"]
    chosen = sorted(found.chosen)
    alike = found.result["indistinguishable"]
    against = {
        tuple(sorted(row["hypothesis"]))
        for row in found.result["rejections"]
        if not interchangeable(row["hypothesis"], chosen, alike)
    }
    blocks: list[Block] = [
        Paragraph(
            "Each hypothesis is a model that was fitted to the records. It is scored by how well it predicts stretches of them that its "
            "fit did not use; a simpler model is kept while the odds against it are below 40 to 1."
        )
    ]
    columns = (
        "hypothesis",
        "it says",
        "predicts worse by",
        "weight of evidence",
        "held-out error",
        "verdict",
    )
    weighed = most_weighed([(row["elements"], row["probability"]) for row in rows])
    table = [_row(found, row, chosen, against, weighed) for row in rows]
    marked = [index for index, row in enumerate(rows) if sorted(row["elements"]) == chosen]
    caption = (
        "Predicts worse by: difference of the logarithm of the predictive density to the best hypothesis, ± one standard error over "
        "stretches of the records. The weights divide the evidence among hypotheses with no more effects than the chosen one; the probability of a "
        "name adds those of all hypotheses that hold it, or a richer law that contains it."
    )
    blocks.append(_evidence(found, rows[:HYPOTHESES_SHOWN], chosen, weighed, against))
    first = tuple(index for index in marked if index < HYPOTHESES_SHOWN)
    blocks.append(Table(caption, columns, tuple(table[:HYPOTHESES_SHOWN]), first))
    if len(table) > HYPOTHESES_SHOWN:
        every = Table("All hypotheses, the best first.", columns, tuple(table), tuple(marked))
        blocks.append(Fold(f"All {len(table)} hypotheses", (every,)))
    if found.result["excluded"]:
        blocks += [
            Heading("What was not tried"),
            Bullets(
                tuple(map(plain, grouped([(one["name"], one["reason"]) for one in found.result["excluded"]])))
            ),
        ]
    return Section("The hypotheses", (*blocks, *_scores(found)))


def _evidence(
    found: Findings,
    rows: Sequence[Mapping[str, Any]],
    chosen: Sequence[str],
    weighed: int,
    against: set[tuple[str, ...]],
) -> Drawing:
    """The hypotheses as a chart; the reasons why some are rejected show under the pointer, and in the table below."""
    reasons = {tuple(sorted(row["hypothesis"])): str(row["reason"]) for row in found.result["rejections"]}
    made = []
    for row in rows:
        elements = tuple(row["elements"])
        key, taken = tuple(sorted(elements)), sorted(elements) == chosen
        alike = interchangeable(elements, chosen, found.result["indistinguishable"])
        reason = reasons.get(key) if key in against and not taken else None
        weight = "rejected" if reason else _weight(row, weighed)
        behind = plus_minus(row["score_difference"], row["standard_error"] or 0.0)
        made.append(
            Evidence(
                _named(found, elements), float(row["score_difference"]), float(row["standard_error"] or 0.0), weight,
                "after" if taken else "third" if alike else "before" if reason else "measured", taken,
                f"{_named(found, elements)}: predicts worse by {behind}" + (f"; rejected: {plain(reason)}" if reason else ""),
            )
        )  # fmt: skip
    words = "; ".join(f"{one.label} {number(one.worse, 3)}, {one.text}" for one in made)
    legend = [
        ("circle after", "chosen"),
        ("circle third", AS_GOOD),
        ("circle before", REJECTED),
        ("circle measured", "less likely"),
    ]
    return Drawing(
        f"The {len(made)} best hypotheses" if len(made) > 1 else "The only hypothesis",
        draw_evidence(
            f"Hypotheses by how much worse than the best they predict: {words}.", made, LEAST_ODDS, "40 to 1",
            "weight",
        ),
        "How much worse than the best hypothesis each predicts stretches that its fit did not use, ± one standard error. Right of the "
        "dotted line the odds against a hypothesis are more than 40 to 1. A dash: it has more effects than the chosen one.",
        tuple(pair for pair in legend if any(f"circle {one.style}" == pair[0] for one in made)),
    )  # fmt: skip


def _weight(row: Mapping[str, Any], weighed: int) -> str:
    """Weight of a hypothesis; a dash if it is not part of the evidence."""
    return NONE if len(row["elements"]) > weighed else f"{row['probability']:.2f}"


def most_weighed(hypotheses: Sequence[tuple[Sequence[str], float]]) -> int:
    """Number of effects beyond which hypotheses, given as (effects, probability), do not share in the evidence: they have no
    probability. Negative where the nominal model stands alone, for its probability among itself says nothing."""
    return max((len(effects) for effects, chance in hypotheses if chance > 0.0), default=0) or -1


def interchangeable(elements: Sequence[str], chosen: Sequence[str], groups: Sequence[Sequence[str]]) -> bool:
    """Whether these elements are the chosen ones but for one, with a name of the same indistinguishable group in its place."""
    mine, other = set(elements) - set(chosen), set(chosen) - set(elements)
    return (
        len(elements) == len(chosen)
        and len(mine) == len(other) == 1
        and any(mine | other <= {*g} for g in groups)
    )


def grouped(excluded: Sequence[tuple[str, str]]) -> list[str]:
    """Candidates that were not tried, given as (name, reason): one line for each reason, with all its names."""
    names: dict[str, list[str]] = {}
    for name, reason in excluded:
        names.setdefault(reason, []).append(name)
    return [f"{', '.join(group)}: {reason}" for reason, group in names.items()]


def _named(found: Findings, elements: Sequence[str]) -> str:
    return " + ".join(map(found.title, elements)) or "nominal model alone"


def _row(
    found: Findings,
    row: Mapping[str, Any],
    chosen: Sequence[str],
    against: set[tuple[str, ...]],
    weighed: int,
) -> tuple[str, ...]:
    elements = tuple(row["elements"])
    name = _named(found, elements)
    if elements in found.unconverged:
        name += " (refit did not settle)"
    behind = "best"
    if row["score_difference"]:
        behind = plus_minus(row["score_difference"], row["standard_error"] or 0.0)
    said = REJECTED if tuple(sorted(elements)) in against else NONE
    if sorted(elements) == chosen:
        said = "chosen"
    elif interchangeable(elements, chosen, found.result["indistinguishable"]):
        said = AS_GOOD
    chance = _weight(row, weighed)
    kind = KINDS.get(row["kind"], pretty_name(row["kind"]))
    return name, kind, behind, chance, percent(row["heldout_nrmse"]), said


def _scores(found: Findings) -> list[Block]:
    """The score tests of all elements; nothing where none were made."""
    shown = found.scores[:SCORES_SHOWN]
    if not shown:
        return []
    best = {effect["element"] for effect in found.result["missing"]}
    bars = [
        Bar(
            found.title(one.element),
            one.statistic,
            number(one.statistic, 3),
            "after" if one.element in best else "measured",
            one.element in best,
        )
        for one in shown
    ]
    figure = Drawing(
        f"The {len(shown)} best scores of {len(found.scores)} elements",
        draw_bars(
            "Best scores: " + ", ".join(f"{bar.label} {bar.text}" for bar in bars),
            bars,
            found.threshold,
            "chance",
        ),
        "Every element of the catalogue was scored against the mismatch, and the most promising became hypotheses: χ² of each "
        "element's best first guess. Related laws score alike; the hypotheses above tell them apart. Dotted line: what chance "
        "reaches once in a hundred diagnoses.",
    )
    listed = Table(
        "All elements that were scored.",
        ("element", "slot", "score χ²"),
        tuple((found.title(one.element), one.slot, number(one.statistic, 3)) for one in found.scores),
    )
    return [figure, Fold(f"All {len(found.scores)} elements", (listed,))]


def rejections_section(found: Findings) -> Section:
    """Reasons against hypotheses, one row for each rule that rejects one."""
    rejections: Sequence[Mapping[str, Any]] = found.result["rejections"]
    title = "Rejected hypotheses, and why"
    if not rejections:
        return Section(title, (Paragraph("No rule rejects any of the hypotheses."),))
    columns = ("hypothesis", "rule", "statistic", "threshold", "reason")
    rows = tuple(
        (
            _named(found, row["hypothesis"]),
            pretty_name(row["name"]),
            number(row["statistic"], 3),
            number(row["threshold"], 3),
            str(row["reason"]),
        )
        for row in rejections
    )
    caption = "A rule rejects a hypothesis whose statistic is below its threshold."
    blocks: list[Block] = [Table(caption, columns, rows[:REJECTIONS_SHOWN])]
    if len(rows) > REJECTIONS_SHOWN:
        every = Table(f"{caption} All rejections.", columns, rows)
        blocks.append(Fold(f"All {len(rows)} rejections", (every,)))
    return Section(title, tuple(blocks))
