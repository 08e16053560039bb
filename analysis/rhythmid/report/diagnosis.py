"""The report of a diagnosis: the verdict first, then where, what, how much better, and what remains open."""

from collections.abc import Iterable

from rhythmid.report.blocks import (
    Block,
    Bullets,
    Drawing,
    Equation,
    Fold,
    Heading,
    Paragraph,
    Section,
    Table,
    Tile,
    Tiles,
)
from rhythmid.report.findings import Findings
from rhythmid.report.location import location_section, unknown_section
from rhythmid.report.page import Page, Tone
from rhythmid.report.quantity import NONE, number, percent, plain, pretty_name, sentence
from rhythmid.report.record_quality import quality_section
from rhythmid.report.residual_figures import cycle_harmonics, error_changes, error_table, residual_folds
from rhythmid.report.row_chart import Bar, draw_bars
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
SCORES_SHOWN = 12


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
            *([_what(found)] if found.repaired else []),
            _better(found),
            _residuals(found),
            _harmonics(found),
            _ranking(found),
            _parameters(found),
            delays_section(result["delays"], found.refitted_delays if found.repaired else None),
            unknown_section(found),
            Section("The next experiment", (Paragraph(sentence(plain(result["next_experiment"])), "lead"),)),
            _calibration(found),
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
    detection = result["detection"]
    said = f"{sentence(summary)} The refitted model's error is {percent(detection['refitted_nominal_nrmse'])} of the {found.whole}"
    if found.noise is not None:
        said += f"; noise alone would make {percent(detection['noise_floor_nrmse'])}"
    return f"{said}."


def _tiles(found: Findings) -> Tiles:
    result = found.result
    fit, detection = result["fit"], result["detection"]
    tiles: list[Tile] = []
    for effect in result["missing"]:
        first = next(iter(effect["parameters"].items()), None)
        if first is not None:
            tiles.append(
                Tile(
                    f"{found.title(effect['element'])}: {pretty_name(first[0])}",
                    told(first[1]),
                    "95 % interval",
                )
            )
    held = fit["refitted_nominal"]["heldout_nrmse"], fit["augmented"]["heldout_nrmse"]
    unseen = [run for run in found.runs if run.heldout]
    hidden = not unseen
    shown = unseen or [run for run in found.runs if run.hidden.any()]
    if held[0] is not None:
        before, after = error_of(shown, "before", hidden), error_of(shown, "after", hidden)
        value = percent(held[0], before.half if before else None)
        if found.repaired:
            value += f" → {percent(held[1], after.half if after else None)}"
        tiles.append(
            Tile(
                f"error on held-out data, of the {found.whole}",
                value,
                "before → after" if found.repaired else "",
            )
        )
    if found.noise is not None:
        tiles.append(
            Tile(
                "least possible: noise alone",
                percent(detection["noise_floor_nrmse"]),
                f"of the {found.whole} in the fitted records, by what repeats in them",
            )
        )
    if result["verdict"] == "missing_physics":
        chance = min(effect["probability"] for effect in result["missing"])
        tiles.append(
            Tile("such a name is right in", percent(chance), "of simulated machines whose truth was known")
        )
    else:
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
    blocks: list[Block] = []
    for effect in result["missing"]:
        blocks.append(Heading(found.title(effect["element"])))
        blocks.append(Equation(effect["equation"]))
        known = found.words.get(effect["element"])
        blocks.append(parameters_table(effect["parameters"], known.parameters if known else None))
        if known is not None:
            names = f"Also known as {_joined(known.also_known_as)}. " if known.also_known_as else ""
            blocks.append(Paragraph(f"{names}Reference: {sentence(known.reference)}", "note"))
        if result["verdict"] == "missing_physics":
            blocks.append(
                Paragraph(
                    f"In simulated machines whose truth was known, a name that led its nearest rival by this much was right in "
                    f"{percent(effect['probability'])} of the cases.",
                    "note",
                )
            )
    blocks += _families(found)
    return Section(title, tuple(blocks))


def _families(found: Findings) -> list[Block]:
    groups = found.result["indistinguishable"]
    if not groups:
        return [Paragraph("No other single element explains these records equally well.", "note")]
    blocks: list[Block] = [Heading("What these records cannot tell apart")]
    for group in groups:
        names = [found.title(name) for name in group]
        hints = [words for a, b, words in found.hints if {a, b} <= set(group)]
        blocks.append(Paragraph(f"{' or '.join(names)}: one of these."))
        if hints:
            blocks.append(Bullets(tuple(f"to tell them apart: {words}" for words in hints)))
    return blocks


def _better(found: Findings) -> Section:
    result = found.result
    fit = result["fit"]
    if found.repaired:
        lead = (
            f"In the records used for the fit the error goes from {percent(fit['refitted_nominal']['train_nrmse'])} to "
            f"{percent(fit['augmented']['train_nrmse'])} of the {found.whole}"
        )
        if fit["augmented"]["heldout_nrmse"] is not None:
            lead += (
                f"; on data that no fit has seen, from {percent(fit['refitted_nominal']['heldout_nrmse'])} to "
                f"{percent(fit['augmented']['heldout_nrmse'])}"
            )
    else:
        lead = f"The refitted nominal model's error is {percent(fit['refitted_nominal']['train_nrmse'])} of the {found.whole}"
        if fit["refitted_nominal"]["heldout_nrmse"] is not None:
            lead += f", and {percent(fit['refitted_nominal']['heldout_nrmse'])} on data that no fit has seen"
    scoring = result.get("scoring") or "free run"
    said = f"{sentence(str(result.get('heldout') or 'nothing was held out'))} Scored in {scoring}"
    said += (
        ": the model is started once and runs on its own for the whole record."
        if scoring == "free run"
        else "."
    )
    as_given = result["detection"]["nominal_nrmse"]
    blocks: list[Block] = [
        Paragraph(f"{lead}.", "lead"),
        Paragraph(f"{said} Before any refit, the nominal model as given: {percent(as_given)}."),
        error_changes(found.runs, found.noise),
        error_table(found.runs, found.output_unit),
    ]
    return Section("How much better it fits", tuple(blocks))


def _residuals(found: Findings) -> Section:
    lead = (
        "What each model fails to explain: the refitted nominal model (before), and the same with what was added (after)."
        if found.repaired
        else "What the refitted nominal model fails to explain."
    )
    return Section(
        "What is left unexplained", (Paragraph(lead), *residual_folds(found.runs, found.output_unit))
    )


def _harmonics(found: Findings) -> Section:
    blocks: list[Block] = []
    forced = [run for run in found.runs if run.phase is not None and run.used.any()]
    quiet = [run for run in forced if run.quiet] or sorted(forced, key=lambda r: -len(r.time))[:1]
    for run in quiet[:3]:
        table = cycle_harmonics(run, found.output_unit, found.slow_noise)
        if table is not None:
            blocks.append(table)
    if isinstance(found.transfer, str):
        blocks.append(Paragraph(sentence(found.transfer)))
    else:
        one = found.transfer
        before = one.before if found.repaired else None
        blocks.append(change_figures(one.frequency, one.indices, before, one.after, one.unit, one.pumping))
    return Section("Harmonics of the cycle and transfer functions", tuple(blocks))


def _ranking(found: Findings) -> Section:
    result = found.result
    score = {one.element: one.statistic for one in found.scores}
    best = tuple(effect["element"] for effect in result["missing"])
    entries = [(best, 0.0, result["fit"]["augmented"]["heldout_nrmse"])]
    entries += [(tuple(o["elements"]), o["delta_bic"], o["heldout_nrmse"]) for o in result["alternatives"]]
    rows = []
    for elements, delta, held in entries:
        name = " + ".join(map(found.title, elements)) or "nominal model alone"
        if elements in found.unconverged:
            name += " (refit did not settle)"
        scores = ", ".join(number(score[e], 3) if e in score else NONE for e in elements) or NONE
        verdict = "chosen" if elements == best else "rejected" if delta > found.worth else "not excluded"
        if verdict == "not excluded" and _richer(found, best, elements):
            verdict = "contains the chosen one, not needed"
        rows.append((name, scores, "0" if elements == best else number(delta, 3), percent(held), verdict))
    blocks: list[Block] = [
        Paragraph(
            "Every element of the catalogue was scored against the mismatch; the most promising were put into the model and "
            "everything refitted."
        ),
        Table(
            f"ΔBIC: how much worse than the chosen model, parameters paid for; above {number(found.worth)} counts as rejected. Score: "
            f"χ² with one degree of freedom in the first round.",
            ("model", "score χ²", "ΔBIC", "held-out error", "verdict"),
            tuple(rows),
            (0,),
        ),
    ]
    if result["excluded"]:
        blocks += [Heading("Could not be tried"), Bullets(tuple(map(plain, result["excluded"])))]
    shown = found.scores[:SCORES_SHOWN]
    if shown:
        bars = [
            Bar(
                found.title(s.element),
                s.statistic,
                number(s.statistic, 3),
                "after" if s.element in best else "measured",
                s.element in best,
            )
            for s in shown
        ]
        figure = Drawing(
            f"The {len(shown)} best scores of {len(found.scores)} elements",
            draw_bars(
                "Best scores: " + ", ".join(f"{b.label} {b.text}" for b in bars),
                bars,
                found.threshold,
                "chance",
            ),
            "χ² of each element's best first guess. Relatives score alike; the refits above tell them apart. Dotted line: what chance "
            "reaches once in a hundred diagnoses.",
        )
        listed = Table(
            "All elements that were scored.",
            ("element", "slot", "score χ²"),
            tuple((found.title(s.element), s.slot, number(s.statistic, 3)) for s in found.scores),
        )
        blocks += [figure, Fold(f"All {len(found.scores)} elements", (listed,))]
    return Section("The ranking", tuple(blocks))


def _richer(found: Findings, best: tuple[str, ...], other: tuple[str, ...]) -> bool:
    """Whether the other model differs from the chosen one by a richer element of which the chosen one is a special case."""
    gone, come = set(best) - set(other), set(other) - set(best)
    return len(gone) == len(come) == 1 and any(
        name in found.words and found.words[name].contained_in and come <= set(found.words[name].contained_in)
        for name in gone
    )


def _parameters(found: Findings) -> Section:
    table = compared_parameters(
        found.nominal, found.refitted, found.result["parameters"] if found.repaired else None, found.at_bound
    )
    return Section("Parameters", (table,))


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
