"""The report of a diagnosis: the verdict first, then where, what, how much better, and what remains open."""

from collections.abc import Iterable, Mapping
from typing import Any

from rhythmid.report.blocks import Block, Bullets, Equation, Heading, Paragraph, Section, Table, Tile, Tiles
from rhythmid.report.correlation import correlation_figure
from rhythmid.report.findings import Findings
from rhythmid.report.hypotheses import hypotheses_section, rejections_section
from rhythmid.report.location import location_section, unknown_section
from rhythmid.report.page import Page, Tone
from rhythmid.report.quantity import number, percent, plain, pretty_name, probability, sentence
from rhythmid.report.record_quality import quality_section
from rhythmid.report.residual_figures import cycle_harmonics, error_changes, error_table, residual_folds
from rhythmid.report.run import error_of
from rhythmid.report.sections import (
    compared_parameters,
    delays_section,
    parameters_table,
    reproduce_section,
    told,
)
from rhythmid.report.transfer_figures import change_figures

VERDICTS: dict[str, tuple[str, Tone]] = {
    "consistent": ("Nothing is missing", "good"),
    "missing_physics": ("Missing physics", "found"),
    "unknown_physics": ("Something unknown is missing", "open"),
    "undecided": ("Undecided", "open"),
}

SCORED = {
    "free_run": "scored in free run: the model is started once and runs on its own for the whole record",
    "windows": "scored in windows, each started anew",
    "effort": "scored by effort: what the measured motion needs by the model, beside what was recorded",
}


def diagnosis_page(found: Findings) -> Page:
    """The report of a diagnosis."""
    result = found.result
    verdict, tone = VERDICTS[result["verdict"]]
    names = " + ".join(found.title(effect["element"]) for effect in result["missing"])
    if result["verdict"] == "missing_physics":
        verdict = f"{verdict}: {names}"
    return Page(
        title=f"rhythmid diagnosis: {verdict}",
        kicker=f"Diagnosis of {found.source}",
        verdict=verdict,
        words=_words(found),
        tone=tone,
        tiles=_tiles(found),
        sections=(
            location_section(found),
            *([_what(found)] if result["missing"] else []),
            _better(found),
            _residuals(found),
            *_harmonics(found),
            hypotheses_section(found),
            rejections_section(found),
            _parameters(found),
            delays_section(result["delays"], (found.refitted_delays or None) if found.repaired else None),
            unknown_section(found),
            Section("The next experiment", (Paragraph(sentence(plain(result["next_experiment"])), "lead"),)),
            _calibration(found),
            *_assumptions(found),
            quality_section(found.records),
            reproduce_section(found.command, found.models),
        ),
    )


def _joined(words: Iterable[str]) -> str:
    listed = list(words)
    return listed[0] if len(listed) == 1 else f"{', '.join(listed[:-1])} and {listed[-1]}" if listed else ""


def _words(found: Findings) -> str:
    """The verdict in two sentences: the summary, and the error where that is a single one."""
    result = found.result
    summary = str(result["summary"])
    if ". " in summary:
        return summary
    detection, whole = result["detection"], found.compared.quantity
    said = f"{sentence(summary)} The refitted model's error is {percent(detection['refitted_nominal_nrmse'])} of the {whole}"
    if found.noise is not None:
        said += f"; noise alone would make {percent(detection['noise_floor_nrmse'])}"
    return f"{said}."


def _heldout(found: Findings) -> str:
    """The error on held-out data before and after, with its uncertainty."""
    fit = found.result["fit"]
    unseen = [run for run in found.runs if run.heldout]
    shown = unseen or [run for run in found.runs if run.hidden.any()]
    before, after = (error_of(shown, which, not unseen) for which in ("before", "after"))
    value = percent(fit["refitted_nominal"]["heldout_nrmse"], before.half if before else None)
    if not found.repaired:
        return value
    return f"{value} → {percent(fit['augmented']['heldout_nrmse'], after.half if after else None)}"


def _tiles(found: Findings) -> Tiles:
    result = found.result
    detection = result["detection"]
    tiles: list[Tile] = []
    for effect in result["missing"]:
        first = next(iter(effect["parameters"].items()), None)
        if first is not None:
            name = f"{found.title(effect['element'])}: {pretty_name(first[0])}"
            tiles.append(Tile(name, told(first[1]), "95 % interval"))
    if result["fit"]["refitted_nominal"]["heldout_nrmse"] is not None:
        note = "before → after" if found.repaired else ""
        tiles.append(Tile(f"error on held-out data, of the {found.compared.quantity}", _heldout(found), note))
    if found.noise is not None:
        tiles.append(
            Tile(
                "least possible: noise alone",
                percent(detection["noise_floor_nrmse"]),
                f"of the {found.compared.quantity} in the fitted records, by what repeats in them",
            )
        )
    if result["verdict"] == "missing_physics":
        several = len(result["missing"]) > 1
        tiles.append(
            Tile(
                f"probability of {'these names' if several else 'this name'}",
                probability(result["joint_probability"]),
                "by the evidence, see the hypotheses",
            )
        )
    elif detection["p_value"] is not None:
        tiles.append(
            Tile(
                "chance of such a mismatch if nothing is missing",
                number(detection["p_value"], 2),
                "p-value of the score tests",
            )
        )
    return Tiles(tuple(tiles))


def _what(found: Findings) -> Section:
    result = found.result
    title = {
        "missing_physics": "What is missing",
        "undecided": "The best explanation so far",
        "unknown_physics": "The nearest known effects, not the name",
    }.get(result["verdict"], "What was added")
    blocks: list[Block] = _families(found) if result["verdict"] == "undecided" else []
    for effect in result["missing"]:
        blocks.append(Heading(found.title(effect["element"])))
        blocks.append(Equation(effect["equation"]))
        known = found.words.get(effect["element"])
        said = f"It explains {percent(effect['share'])} of the mismatch"
        if result["verdict"] == "missing_physics":  # otherwise the verdict does not state the name
            said += f"; the probability of the name is {probability(effect['probability'])}"
        blocks.append(Paragraph(f"{said}."))
        blocks.append(parameters_table(effect["parameters"], known.parameters if known else None))
        if known is not None:
            names = f"Also known as {_joined(known.also_known_as)}. " if known.also_known_as else ""
            blocks.append(Paragraph(f"{names}Reference: {sentence(known.reference)}", "note"))
    blocks += _not_separated(found)
    return Section(title, tuple(blocks))


def _families(found: Findings) -> list[Block]:
    """The kinds of physics that are missing, whose laws share their evidence."""
    rows = [
        (
            str(one["family"]),
            probability(one["probability"]),
            percent(one["share"]),
            ", ".join(found.title(name) for name in one["laws"]),
        )
        for one in found.result["families"]
    ]
    if not rows:
        return []
    caption = (
        "Laws of one family share their evidence, so that the family may be certain where the law is not."
    )
    columns = (
        "family",
        "probability that a law of it is missing",
        "share of the mismatch",
        "laws that are open",
    )
    return [Table(caption, columns, tuple(rows))]


def _not_separated(found: Findings) -> list[Block]:
    groups = found.result["indistinguishable"]
    if not groups:
        return [Paragraph("No other single element explains these records equally well.", "note")]
    blocks: list[Block] = [Heading("What these records do not separate")]
    for group in groups:
        names = [found.title(name) for name in group]
        hints = {
            (frozenset((a, b)), words): f"{found.title(a)} and {found.title(b)}: {words}"
            for a, b, words in found.hints
            if {a, b} <= set(group)
        }
        blocks.append(Paragraph(f"One of these: {', '.join(names[:-1])} or {names[-1]}."))
        if hints:
            blocks.append(Bullets(tuple(hints.values())))
    return blocks


def _better(found: Findings) -> Section:
    result = found.result
    fit, whole = result["fit"], found.compared.quantity
    if found.repaired:
        lead = (
            f"In the records used for the fit the error goes from {percent(fit['refitted_nominal']['train_nrmse'])} to "
            f"{percent(fit['augmented']['train_nrmse'])} of the {whole}"
        )
        if fit["augmented"]["heldout_nrmse"] is not None:
            lead += (
                f"; on data that no fit has seen, from {percent(fit['refitted_nominal']['heldout_nrmse'])} to "
                f"{percent(fit['augmented']['heldout_nrmse'])}"
            )
    else:
        lead = f"The refitted nominal model's error is {percent(fit['refitted_nominal']['train_nrmse'])} of the {whole}"
        if fit["refitted_nominal"]["heldout_nrmse"] is not None:
            lead += f", and {percent(fit['refitted_nominal']['heldout_nrmse'])} on data that no fit has seen"
    said = f"{sentence(str(result.get('heldout') or 'nothing was held out'))} {_scored(result['scoring'])}"
    as_given = result["detection"]["nominal_nrmse"]
    blocks: list[Block] = [Paragraph(f"{lead}.", "lead"), Paragraph(said)]
    if as_given is not None:
        blocks.append(Paragraph(f"Before any refit, the nominal model as given: {percent(as_given)}."))
    if found.runs:
        blocks.append(error_changes(found.runs, found.noise, found.compared))
        blocks.append(error_table(found.runs, found.compared))
    return Section("How much better it fits", tuple(blocks))


def _scored(scoring: Mapping[str, Any]) -> str:
    """How the records were scored and why, in sentences."""
    how = SCORED[scoring["kind"]]
    if scoring["bandwidth"] is not None:
        how += f", below {number(scoring['bandwidth'], 3)} Hz"
    return f"{sentence(how)} Why: {scoring['reason'].rstrip('.')}."


def _residuals(found: Findings) -> Section:
    lead = (
        f"What each model fails to explain: the refitted nominal model (before), and the one {found.changed} (after)."
        if found.repaired
        else "What the refitted nominal model fails to explain."
    )
    return Section(
        "What is left unexplained",
        (Paragraph(lead), *residual_folds(found.runs, found.compared, found.output_unit)),
    )


def _harmonics(found: Findings) -> list[Section]:
    """Harmonics and transfer functions, if they were computed."""
    blocks: list[Block] = []
    forced = []
    if found.slow_noise is not None:
        forced = [run for run in found.runs if run.phase is not None and run.used.any()]
    quiet = [run for run in forced if run.quiet] or sorted(forced, key=lambda r: -len(r.time))[:1]
    for run in quiet[:3]:
        table = cycle_harmonics(run, found.output_unit, found.slow_noise or 0.0)
        if table is not None:
            blocks.append(table)
    if isinstance(found.transfer, str):
        blocks.append(Paragraph(sentence(found.transfer)))
    elif found.transfer is not None:
        one = found.transfer
        before = one.before if found.repaired else None
        blocks.append(change_figures(one.frequency, one.indices, before, one.after, one.unit, one.pumping))
    return [Section("Harmonics of the cycle and transfer functions", tuple(blocks))] if blocks else []


def _parameters(found: Findings) -> Section:
    table = compared_parameters(
        found.nominal, found.refitted, found.result["parameters"] if found.repaired else None, found.at_bound
    )
    figure = [] if found.correlation is None else [correlation_figure(found.correlation)]
    return Section("Parameters", (table, *figure))


def _calibration(found: Findings) -> Section:
    lines = tuple(sentence(plain(line)) for line in found.result["calibration"])
    if not lines:
        return Section("Calibration", (Paragraph("The records agree with the nominal model's parameters."),))
    return Section(
        "Calibration",
        (
            Paragraph(
                "Parameters that are merely wrong are not missing physics. These differ from the nominal model (± one standard deviation):"
            ),
            Bullets(lines),
        ),
    )


def _assumptions(found: Findings) -> list[Section]:
    """Assumptions of the answer; empty if it has none."""
    lines = tuple(sentence(plain(line)) for line in found.result["assumptions"])
    return [Section("What was assumed", (Bullets(lines),))] if lines else []
