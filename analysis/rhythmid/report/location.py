"""Where model and machine differ, and what remains unexplained: sections of a diagnosis' report."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from rhythmid.report.blocks import Block, Bullets, Columns, Drawing, Fold, Paragraph, Section, drawing
from rhythmid.report.chart import Chart, Curve
from rhythmid.report.findings import ElementScore, Findings, FreeFunction
from rhythmid.report.quantity import (
    number,
    percent,
    plain,
    pretty_unit,
    remaining_error,
    scaled,
    sentence,
    with_unit,
)
from rhythmid.report.row_chart import Bar, draw_bars
from rhythmid.report.run import worst_place
from rhythmid.report.signal_path import SlotContent, draw_signal_path

SHARE = 0.2  # share of the mismatch above which it is said to depend on a quantity
TELLING = 0.05  # share of the mismatch above which a free function is shown


def location_section(found: Findings) -> Section:
    result = found.result
    slots = _slots(found)
    faulty = [name for name, content in slots.items() if content.faulty]
    alt = "Signal path from the command u through command, actuator, force and sensor to the output y. " + (
        f"Marked as faulty: {', '.join(faulty)}." if faulty else "No slot is marked."
    )
    sure = result["verdict"] == "missing_physics"
    note = "missing here" if sure else "suspected here"
    blocks: list[Block] = [
        Paragraph(
            sentence(
                f"the fault {'is' if sure else 'seems to be'} {result['location']['where']}"
                if faulty
                else result["location"]["where"]
            ),
            "lead",
        ),
        Drawing(
            "The signal path",
            draw_signal_path(slots, found.forced, alt, note),
            "The machine as a chain from command u to output y. Red: the slot that the nominal model gets wrong."
            if faulty
            else "The machine as a chain from command u to output y, with the elements of the nominal model.",
            wide=True,
        ),
    ]
    place = worst_place(found.runs)
    if place is not None and faulty:
        phase = f", {place.phase:.2f} of a cycle after the forcing's peak" if place.phase is not None else ""
        factor, unit = scaled(abs(place.position), found.output_unit)
        blocks.append(
            Paragraph(
                f"Model and record differ most in “{place.run.name}”, around {number(place.time, 3)} s{phase}, at x = "
                f"{with_unit(number(factor * place.position, 3), unit)} and v = "
                f"{with_unit(number(place.velocity, 2), f'{found.output_unit}/s')}; the mismatch is strongest at "
                f"{number(place.frequency, 3)} Hz, which carries {percent(place.share)} of its power."
            )
        )
    figures = [one for one in (_slot_scores(found), _dependences(found)) if one is not None]
    if figures:
        blocks.append(Columns(tuple(figures)))
    evidence = tuple(result["location"]["evidence"])
    if evidence:
        blocks.append(Fold("The evidence in words", (Bullets(tuple(map(plain, evidence))),)))
    return Section("Where model and machine differ", tuple(blocks))


def _slots(found: Findings) -> dict[str, SlotContent]:
    """What each slot of the signal path contains, and which is faulty."""
    missing: dict[str, list[str]] = {}
    for effect in found.result["missing"]:
        missing.setdefault(effect["slot"], []).append(found.title(effect["element"]))
    return {
        name: SlotContent(
            tuple(map(found.title, found.slots.get(name, ()))),
            tuple(missing.get(name, ())),
            not missing and name == found.result["location"]["slot"],
        )
        for name in ("command", "actuator", "force", "sensor", "timing")
    }


def _slot_scores(found: Findings) -> Drawing | None:
    slot = found.result["location"]["slot"]
    best: dict[str, ElementScore] = {}
    for one in found.scores:
        if one.slot not in best or one.statistic > best[one.slot].statistic:
            best[one.slot] = one
    if not best:
        return None
    bars = [
        Bar(
            one.slot,
            one.statistic,
            number(one.statistic, 3),
            "after" if one.slot == slot else "measured",
            one.slot == slot,
        )
        for one in sorted(best.values(), key=lambda s: -s.statistic)
    ]
    return Drawing(
        "Best score in each slot",
        draw_bars(
            "Best score test in each slot: " + ", ".join(f"{bar.label} {bar.text}" for bar in bars),
            bars,
            found.threshold,
            "chance",
        ),
        "How strongly the best element of each slot would explain the mismatch (χ² of its score test). Scores beyond the dotted line "
        "are not due to chance. The refits below decide.",
    )


def _dependences(found: Findings) -> Drawing | None:
    """What a free function of each quantity would explain."""
    if not found.functions:
        return None
    shares = {one.quantity: 100.0 * max(one.explained, 0.0) for one in found.functions}
    bars = [Bar(quantity, share, f"{share:.0f}\u202f%") for quantity, share in shares.items()]
    if found.result["verdict"] == "consistent":
        reading = "What is left depends on none of them."
    elif max(shares.values()) > 100.0 * SHARE:
        reading = "The long bars show what the missing force depends on."
    else:
        reading = "No long bar: the fault is no force that depends on the present state alone, or too large to be mapped."
    return Drawing(
        "What the mismatch depends on",
        draw_bars(
            "Share of the mismatch that a free function explains: "
            + ", ".join(f"{bar.label} {bar.text}" for bar in bars),
            bars,
            full=100.0,
        ),
        f"Share of the mismatch that a free function of each quantity explains, beyond what chance would. {reading}",
    )


def unknown_section(found: Findings) -> Section:
    """The remainder of the named effects: its share of the mismatch, the quantity on which it depends, and its curve over that quantity."""
    left = found.result["remainder"]
    verdict = found.result["verdict"]
    if left["significant"] and verdict == "consistent":
        fit = found.result["fit"]["refitted_nominal"]
        error = fit["train_nrmse"] if fit["heldout_nrmse"] is None else fit["heldout_nrmse"]
        said = (
            f"Nothing of practical size is left: {remaining_error(error, found.result['scoring']['kind'])}. Part of it is more than "
            f"chance and depends on {left['goes_with']}."
        )
    elif left["significant"]:
        said = (
            f"The final model leaves {percent(left['share'])} of the mismatch, by more than chance. What is left depends on "
            f"{left['goes_with']}."
        )
        said += (
            " The names stand all the same: they carry nearly all of it."
            if verdict == "missing_physics"
            else " The names do not explain that."
        )
    elif verdict == "unknown_physics":
        said = (
            "Something is left that no element of the catalogue explains, and no function of one of the quantities that were "
            "tried either: memory, a disturbance, or an effect in the path of command or measurement."
        )
    else:
        said = (
            "The final model leaves nothing that a free function predicts better than chance. Effects smaller than the noise, "
            "or in states that the records never reached, stay unseen."
        )
    blocks: list[Block] = [Paragraph(said)]
    chosen = _most_telling(found.functions, left["goes_with"] if left["significant"] else None)
    figures = [_force_map(one, found.repaired) for one in chosen]
    if left["curve"] is not None and left["goes_with"] not in [one.quantity for one in chosen]:
        figures.append(_curve(found, left))
    if figures:
        blocks.append(Columns(tuple(figures)))
    for line in found.result["notes"]:
        blocks.append(Paragraph(sentence(line)))
    return Section("What remains unknown", tuple(blocks))


def _most_telling(functions: Sequence[FreeFunction], goes_with: str | None) -> list[FreeFunction]:
    """The function that explains most, and the one that the remainder depends on where that is another."""
    drawn = [f for f in functions if len(f.force)]
    chosen = [f for f in drawn[:1] if f.explained > TELLING]
    return chosen + [f for f in drawn if f.quantity == goes_with and f not in chosen]


def _curve(found: Findings, left: Mapping[str, Any]) -> Drawing:
    """The curve of the remainder, as the diagnosis has it."""
    quantity = str(left["goes_with"])
    grid, force = np.array(left["curve"]["grid"]), np.array(left["curve"]["force"])
    sensor = "sensor" in quantity
    factor, unit = scaled(
        float(np.max(np.abs(force), initial=0.0)), found.output_unit if sensor else found.force_unit
    )
    along, grid_unit = scaled(float(np.max(np.abs(grid), initial=0.0)), found.unit_of(quantity))
    kind = "sensor error" if sensor else "force"
    return drawing(
        f"What is left over {quantity}",
        Chart(
            f"Remaining {kind} over {quantity}.", f"{quantity} [{pretty_unit(grid_unit)}]", f"{kind} [{pretty_unit(unit)}]",
            (Curve(along * grid, factor * force, "left by the final model", "after"),),
        ),
        f"What the final model leaves as a free function of {quantity}, no formula assumed. A law that the model lacks shows by "
        "its shape.",
    )  # fmt: skip


def _force_map(one: FreeFunction, repaired: bool) -> Drawing:
    largest = float(np.max(np.abs(one.force), initial=0.0))
    if one.force_after is not None:
        largest = max(largest, float(np.max(np.abs(one.force_after), initial=0.0)))
    factor, unit = scaled(largest, one.force_unit)
    along, grid_unit = scaled(float(np.max(np.abs(one.grid), initial=0.0)), one.grid_unit)
    curves = [
        Curve(along * one.grid, factor * one.force, "missing before" if repaired else "missing", "before")
    ]
    words = f"explains {100.0 * max(one.explained, 0.0):.0f} % of the mismatch"
    reading = ""
    if repaired and one.grid_after is not None and one.force_after is not None and len(one.force_after):
        curves.append(Curve(along * one.grid_after, factor * one.force_after, "missing after", "after"))
        words += f" before, {100.0 * max(one.explained_after or 0.0, 0.0):.0f} % after"
        reading = " A curve that comes down to zero has been accounted for."
    kind = "sensor error" if "sensor" in one.quantity else "force"
    return drawing(
        f"Missing {kind} over {one.quantity}",
        Chart(
            f"Missing {kind} as a free function of {one.quantity}.", f"{one.quantity} [{pretty_unit(grid_unit)}]",
            f"{kind} [{pretty_unit(unit)}]", tuple(curves),
        ),
        f"The mismatch as a free function of {one.quantity}, no formula assumed; it {words}. Left out: what the nominal "
        f"model's own parameters can absorb (an offset; a slope over position or velocity).{reading}",
    )  # fmt: skip
