"""Sections that every report has: parameters, delays, how to reproduce it."""

import platform
from collections.abc import Mapping, Sequence
from importlib.metadata import PackageNotFoundError, version
from typing import Any

from rhythmid import __version__
from rhythmid.report.blocks import Block, Code, Fold, Paragraph, Section, Table
from rhythmid.report.quantity import NONE, estimate, number, pretty_name, scaled, with_unit
from rhythmid.statistics import NORMAL_95

PACKAGES = ("numpy", "scipy", "numba", "rosbags")
DELAYS = {"input": "input delay τ_u", "measurement": "measurement delay τ_y", "sum": "sum τ_u + τ_y"}
MILLISECONDS = {"value": 1e-3, "unit": "s"}  # shown as
Estimates = Mapping[str, Mapping[str, Any]]  # name -> {"value", "std", "unit"}


def told(one: Mapping[str, Any] | None, like: Mapping[str, Any] | None = None) -> str:
    """An estimate {"value", "std", "unit"} in words, in the unit that suits its size, or that of `like`."""
    if not one or one.get("value") is None:
        return NONE
    factor, unit = _shown(like or one)
    return estimate(float(one["value"]), one.get("std"), unit, factor)


def _shown(one: Mapping[str, Any]) -> tuple[float, str]:
    """Factor and unit in which an estimate is printed."""
    size = max(abs(float(one.get("value") or 0.0)), NORMAL_95 * float(one.get("std") or 0.0))
    return scaled(size, str(one.get("unit", "")))


def parameters_table(
    found: Estimates,
    meanings: Mapping[str, str] | None = None,
    caption: str = "Parameters with 95 % intervals.",
) -> Table:
    """Estimates by name, with their meaning if known."""
    if meanings:
        rows = tuple((pretty_name(name), told(one), meanings.get(name, "")) for name, one in found.items())
        return Table(caption, ("parameter", "value", "meaning"), rows, formulas=(2,))
    return Table(
        caption, ("parameter", "value"), tuple((pretty_name(name), told(one)) for name, one in found.items())
    )


def compared_parameters(
    nominal: Estimates, refitted: Estimates, augmented: Estimates | None, at_bound: Sequence[str] = ()
) -> Table:
    """Parameters as given, of the refitted nominal model, and of the final model."""
    final = augmented if augmented is not None else refitted
    rows, marked = [], []
    for name, one in final.items():
        given, bent = nominal.get(name), refitted.get(name)
        limit = " (at its bound)" if name in at_bound else ""
        factor, unit = _shown(one)
        as_given = with_unit(number(factor * given["value"], 6), unit) if given else "not in it"
        row = [pretty_name(name), as_given, told(bent, one) if bent else "not in it"]
        if augmented is not None:
            row += [told(one) + limit, _moved(bent, one)]
        else:
            row[-1] += limit
        if bent is None:
            marked.append(len(rows))
        rows.append(tuple(row))
    columns = ("parameter", "nominal model", "nominal model, refitted")
    caption = "Parameters with 95 % intervals."
    if augmented is not None:
        columns += ("final model", "change")
        caption += (
            " The last column is how far the refit of the nominal model was off to make up for what it "
            "lacks. Shaded rows are new."
        )
    return Table(caption, columns, tuple(rows), tuple(marked))


def _moved(bent: Mapping[str, Any] | None, final: Mapping[str, Any]) -> str:
    if bent is None:
        return "new"
    if final.get("std") == 0.0:
        return NONE
    change = float(final["value"]) - float(bent["value"])
    size = abs(float(bent["value"]))
    if final.get("unit") == "s":
        factor, unit = scaled(abs(change), "s")
        return ("+" if change >= 0 else "") + with_unit(number(factor * change, 3), unit)
    if size == 0.0:
        return with_unit(number(change, 3), str(final.get("unit", "")))
    return ("+" if change >= 0 else "") + number(100.0 * change / size, 2) + "\u202f%"


def delays_section(delays: Mapping[str, Any], before: Mapping[str, Any] | None = None) -> Section:
    """The delays with the evidence that separates them. `before` are those of the refitted nominal model, for comparison."""
    rows = []
    for key, name in DELAYS.items():
        if not delays.get(key):
            continue
        row = [name]
        if before is not None:
            row.append(told(before.get(key), MILLISECONDS))
        rows.append((*row, told(delays[key], MILLISECONDS)))
    if not rows:
        return Section("Delays", (Paragraph("The model has no delay, so none was estimated."),))
    columns = (
        ("delay", "final model") if before is None else ("delay", "nominal model, refitted", "final model")
    )
    blocks: list[Block] = [Table("Delays with 95 % intervals.", columns, tuple(rows))]
    assumption = str(delays.get("assumption") or "")
    if delays.get("separable"):
        said = "These records separate the two delays"
        blocks.append(Paragraph(f"{said}, provided that {_lower(assumption)}." if assumption else f"{said}."))
    else:
        said = "Use only the sum of the two delays"
        blocks.append(Paragraph(f"{said}: {_lower(assumption)}." if assumption else f"{said}."))
    closure = (delays.get("closure") or {}).get("z")
    if closure is not None:
        blocks.append(
            Paragraph(
                "Check (closure): the phase of the limit cycle plus the offset of the sidebands gives the sum of the delays, and so does the slope of G₀. "
                f"The two differ by {number(abs(closure), 2)} standard deviations; more than 3 would mean that the model is wrong."
            )
        )
    if before is not None:
        blocks.append(
            Paragraph(
                "A model that lacks an effect compensates for it with its delays, too. Use the delays of the final model.",
                "note",
            )
        )
    return Section("Delays", tuple(blocks))


def _lower(text: str) -> str:
    return text[:1].lower() + text[1:].rstrip(".") if text else ""


def reproduce_section(command: str, models: Mapping[str, str]) -> Section:
    """The command line, the software versions, and the models as files (title -> YAML text)."""
    versions = [f"rhythmid {__version__}", f"Python {platform.python_version()}"]
    for package in PACKAGES:
        try:
            versions.append(f"{package} {version(package)}")
        except PackageNotFoundError:
            continue
    folds = tuple(Fold(title, (Code("YAML", text),)) for title, text in models.items())
    return Section(
        "How to reproduce this",
        (
            Code("Command", command),
            Paragraph(f"Versions: {', '.join(versions)}. The same records give the same result."),
            *folds,
        ),
    )
