"""Comparison of a simulation with a recording: a section of a diagnosis' report, or a separate page."""

from collections.abc import Mapping, Sequence
from typing import Any

from rhythmid.report.blocks import Block, Bullets, Drawing, Paragraph, Section, Table, Tile, Tiles
from rhythmid.report.page import Page, Tone
from rhythmid.report.quantity import NONE, number, percent, pretty_name, scaled, sentence, with_unit
from rhythmid.report.record_quality import RecordQuality, quality_section
from rhythmid.report.residual_figures import residual_figures
from rhythmid.report.run import Compared, Run
from rhythmid.report.sections import reproduce_section
from rhythmid.report.signal_path import SlotContent, draw_signal_path

TITLE = "Simulation against recording"
LABELS = ("simulation", "simulation with what explains it")
CLOCKS = {"command": "the commands", "forcing": "the forcing's phase", "output": "the motions themselves"}


def comparison_page(
    result: Mapping[str, Any], run: Run, unit: str, records: Sequence[RecordQuality], command: str
) -> Page:
    """The report of a comparison without a model; `result` is the JSON's "comparison", `run` recording and simulation."""
    verdict, tone = _verdict(result)
    return Page(
        title=f"rhythmid comparison: {verdict}",
        kicker=f"Comparison of {result['simulation']} with {result['recording']}",
        verdict=verdict,
        words=result["summary"],
        tone=tone,
        tiles=_tiles(result),
        sections=(
            comparison_section(result, run, unit, path=True),
            quality_section(records),
            reproduce_section(command, {}),
        ),
    )


def _verdict(result: Mapping[str, Any]) -> tuple[str, Tone]:
    if not result["comparable"]:
        return "Not comparable", "open"
    if not result["parted"]:
        return "Simulation and recording agree", "good"
    names = " + ".join(_name(one) for one in result["explanations"] if one["slot"] is not None)
    return f"They part: {names}", "found"


def _tiles(result: Mapping[str, Any]) -> Tiles:
    alignment = result["alignment"]
    return Tiles(
        (
            Tile(
                "difference, of the motion",
                percent(result["nrmse"]),
                f"noise: {percent(result['noise_nrmse'])}",
            ),
            Tile(
                "the recording begins later by",
                _seconds(alignment["offset"]["value"]),
                f"by {CLOCKS[alignment['by']]}",
            ),
        )
    )


def _seconds(value: float) -> str:
    factor, unit = scaled(abs(value), "s")
    return with_unit(number(factor * value, 5), unit)


def comparison_section(result: Mapping[str, Any], run: Run, unit: str, path: bool = False) -> Section:
    """Results of a comparison; with `path` the signal path is drawn as well."""
    blocks: list[Block] = [] if path else [Paragraph(result["summary"], "lead")]
    if path and result["slot"] is not None:
        names = [one for one in result["explanations"] if one["slot"] is not None]
        slots = {
            slot: SlotContent(("as simulated",), tuple(_name(one) for one in names if one["slot"] == slot))
            for slot in ("command", "actuator", "force", "sensor", "timing")
        }
        alt = f"Signal path from the command u to the output y. Marked: {', '.join(one['slot'] for one in names)}."
        blocks.append(
            Drawing(
                "The signal path",
                draw_signal_path(slots, run.phase is not None, alt, "they part here"),
                "The machine as a chain from command u to output y. Red: where simulation and recording part.",
                wide=True,
            )
        )
    if result["explanations"]:
        blocks.append(_explanations(result))
    blocks.append(_alignment(result))
    blocks.extend(residual_figures(run, Compared("motion", unit), unit))
    if result["harmonics"]:
        blocks.append(_harmonics(result))
    if result["notes"]:
        blocks.append(Bullets(tuple(map(sentence, result["notes"]))))
    return Section(TITLE, tuple(blocks))


def _name(one: Mapping[str, Any]) -> str:
    """An explanation's name: an element, or a force that depends on a quantity."""
    if "_" in one["name"] or one["slot"] is None:
        return pretty_name(one["name"])
    return f"{'force' if one['slot'] == 'force' else 'effect'} that depends on {one['name']}"


def _explanations(result: Mapping[str, Any]) -> Table:
    rows = []
    for one in result["explanations"]:
        sizes = []
        for name, size in one["parameters"].items():
            factor, unit = scaled(abs(size["value"]), size["unit"])
            sizes.append(f"{pretty_name(name)} {with_unit(number(factor * size['value'], 4), unit)}")
        rows.append(
            (
                _name(one), one["slot"] or NONE, ", ".join(sizes) or NONE, percent(one["explained"]),
                " or ".join(map(pretty_name, one["also"])) or NONE,
            )
        )  # fmt: skip
    return Table(
        "What explains the difference, the most first; each with its share of what was left before it.",
        ("effect", "slot", "size", "explains", "looks the same from outside"),
        tuple(rows),
    )


def _alignment(result: Mapping[str, Any]) -> Table:
    alignment, rates = result["alignment"], result["rates"]
    offset = alignment["offset"]
    rows = [
        (
            "offset of the recording",
            f"{_seconds(offset['value'])} ± {_seconds(2.0 * (offset['std'] or 0.0))}",
        ),
        ("found by", CLOCKS[alignment["by"]]),
        ("in common", with_unit(number(result["overlap"]["value"], 4), "s")),
        (
            "rates",
            f"{with_unit(number(rates['simulation'], 6), 'Hz')} and {with_unit(number(rates['recording'], 6), 'Hz')}",
        ),
        ("commands differ by", percent(alignment["command_difference"])),
    ]
    if alignment["mismatch"]:
        rows.append(("different excitation", alignment["mismatch"]))
    if result["through_model"]:
        rows.append(
            ("compared with", "the model, fitted to the simulation and run with the recording's inputs")
        )
    return Table("How the two were brought together.", ("what", "value"), tuple(rows))


def _harmonics(result: Mapping[str, Any]) -> Table:
    rows = tuple(
        (f"harmonic {one['number']}", number(one["gain"], 4), _seconds(one["late"]))
        for one in result["harmonics"]
    )
    return Table(
        "Harmonics of the forcing, recording over simulation. A delay makes all of them late by the same time, a sensor's gain changes "
        "all by the same factor.",
        ("harmonic of the forcing", "amplitude ratio", "late by"),
        rows,
    )
