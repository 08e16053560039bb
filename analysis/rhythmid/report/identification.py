"""The report of an identification: parameters, delays, transfer functions, and how well they explain the records."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from rhythmid.report.blocks import Block, Bullets, Fold, Paragraph, Section, Table, Tile, Tiles
from rhythmid.report.correlation import Correlation, correlation_figure
from rhythmid.report.page import Page
from rhythmid.report.quantity import (
    NONE,
    number,
    percent,
    plain,
    pretty_name,
    probability,
    sentence,
    with_unit,
)
from rhythmid.report.record_quality import RecordQuality, quality_section
from rhythmid.report.residual_figures import error_table, residual_folds
from rhythmid.report.run import Compared, Run
from rhythmid.report.sections import (
    DELAYS,
    MILLISECONDS,
    delays_section,
    parameters_table,
    reproduce_section,
    told,
)
from rhythmid.report.transfer_figures import TransferFunction, harmonic_name, scaled_ratio, transfer_grid

SHOWN = 1  # |m| up to which transfer functions are shown; others are shown on demand
OBSERVABLES = {
    "A": "the phase of the limit cycle",
    "B": "the slope of G₀",
    "C": "the offset of the sidebands",
}
METHODS = ("G0", "G-1", "G+1")
LEVELS = ("std", "noise", "even_distortion", "odd_distortion", "aliasing")
FOUND_BY = {
    "separated_lines": "Each function was read off the frequencies that its harmonic reaches alone; frequencies that none "
    "reaches show the errors.",
    "local_rational": "The functions were fitted locally, with transients, around each frequency; what the fit leaves shows the errors.",
    "regularised_least_squares": "The functions were smoothed along frequency by regularised least squares, the paper's equation (5), "
    "because the excitation allows no other method.",
}


def identification_page(
    result: Mapping[str, Any],
    source: str,
    records: Sequence[RecordQuality],
    command: str,
    models: Mapping[str, str],
    transfer: Sequence[TransferFunction] | None = None,
    unit: str = "m/N",
    runs: Sequence[Run] = (),
    position: str = "m",
) -> Page:
    """The report of `identify`.

    `result` is what `identify --json` writes; `source` names model and records; `models` are YAML texts by title; `unit` that of
    the transfer functions. `transfer` replaces the functions in `result` if they have more information, such as the fitted
    model's. `runs` are the records beside the identified model's free run, `position` the unit of the motion.
    """
    functions = list(transfer) if transfer is not None else functions_of(result)
    return Page(
        title="rhythmid identification",
        kicker=f"Identification of {source}",
        verdict=_verdict(result),
        words=_words(result),
        tone="good" if result.get("usable", True) and result["delays"].get("separable") else "open",
        tiles=_tiles(result),
        sections=(
            _parameters(result),
            _delays(result),
            *_residuals(runs, position),
            transfer_section(functions, unit, *_errors(result, unit), *_missing(result)),
            *_paper(result),
            _remarks(result),
            quality_section(records),
            reproduce_section(command, models),
        ),
    )


def _parameters(result: Mapping[str, Any]) -> Section:
    """The estimates, and the correlation of their errors if they were fitted together."""
    blocks: list[Block] = [parameters_table(result["parameters"])]
    covariance = result.get("covariance")
    if covariance is not None and len(covariance["names"]) > 1:
        matrix = np.array(covariance["correlation"], dtype=float)
        blocks.append(correlation_figure(Correlation(tuple(covariance["names"]), matrix)))
    return Section("Parameters", tuple(blocks))


def _residuals(runs: Sequence[Run], position: str) -> list[Section]:
    """Residual of the identified model; empty if the model was not simulated."""
    if not runs:
        return []
    compared = Compared("motion", position)
    lead = Paragraph(
        "The identified model runs on its own from the beginning of each record. What it leaves is noise, or physics that it lacks."
    )
    blocks = (error_table(runs, compared), *residual_folds(runs, compared, position))
    return [Section("Measured motion and what is left of it", (lead, *blocks))]


def functions_of(result: Mapping[str, Any]) -> list[TransferFunction]:
    """Transfer functions from the JSON's "harmonics"."""
    return [
        TransferFunction(
            int(one["m"]),
            np.asarray(one["frequency"], dtype=float),
            np.asarray(one["magnitude"], dtype=float) * np.exp(1j * np.asarray(one["phase"], dtype=float)),
            np.asarray(one["radius"], dtype=float) if one.get("radius") else None,
        )
        for one in result.get("harmonics") or ()
    ]


def _verdict(result: Mapping[str, Any]) -> str:
    if not result.get("usable", True):
        return "Not identified"
    separable = result["delays"].get("separable")
    return "Identified" if separable else "Identified, but for the split of the delays"


def _words(result: Mapping[str, Any]) -> str:
    delays = result["delays"]
    if not result.get("usable", True):
        return " ".join(f"{sentence(one['text'])} {one['question']}" for one in result["warnings"])
    if delays.get("separable"):
        first = (
            f"The command acts {told(delays['input'], MILLISECONDS)} late, and the measurement arrives "
            f"{told(delays['measurement'], MILLISECONDS)} late."
        )
    elif delays.get("sum"):
        first = f"Command and measurement are {told(delays['sum'], MILLISECONDS)} late together; the records do not say which by how much."
    else:
        first = "No delay was estimated."
    error = (result.get("quality") or {}).get("nrmse")
    unseen = (result.get("held_out") or {}).get("nrmse")
    more = "" if unseen is None else f", and {percent(unseen)} of that of the held-out records"
    return f"{first} Running on its own, the identified model misses {percent(error)} of the motion{more}."


def _tiles(result: Mapping[str, Any]) -> Tiles:
    delays = result["delays"]
    keys = ("input", "measurement") if delays.get("separable") else ("sum",)
    names = {"input": "input delay", "measurement": "measurement delay", "sum": "sum of the delays"}
    tiles = [
        Tile(names[key], told(delays[key], MILLISECONDS), "95 % interval") for key in keys if delays.get(key)
    ]
    tiles += [
        Tile(pretty_name(n), told(one), "95 % interval") for n, one in list(result["parameters"].items())[:3]
    ]
    return Tiles(tuple(tiles))


def _delays(result: Mapping[str, Any]) -> Section:
    """The delays, and what is known if they are not separable."""
    delays = result["delays"]
    section = delays_section(delays)
    more: list[Block] = []
    for name, (low, high) in (delays.get("intervals") or {}).items():
        pair = f"{_milliseconds(low)} and {_milliseconds(high)}"
        more.append(
            Paragraph(f"All that can be said of {DELAYS.get(name, name)}: it lies between {pair} (95 %).")
        )
    aliases = "; ".join(f"{number(1e3 * a)} and {number(1e3 * b)} ms" for a, b in delays.get("aliases") or ())
    if aliases:
        more.append(
            Paragraph(
                f"Phases repeat every cycle, so these pairs of τ_u and τ_y would fit as well: {aliases}."
            )
        )
    if delays.get("undetermined"):
        more += [Paragraph("The records do not notice:"), Bullets(tuple(map(plain, delays["undetermined"])))]
    seen = delays.get("observables") or {}
    rows = tuple((name, told(seen[key], MILLISECONDS)) for key, name in OBSERVABLES.items() if seen.get(key))
    if rows:
        more.append(
            Table(
                "The three delays that can be seen directly, with 95 % intervals.", ("seen in", "delay"), rows
            )
        )
    return Section(section.title, (*section.blocks, *more))


def transfer_section(functions: Sequence[TransferFunction], unit: str = "m/N", *more: Block) -> Section:
    """Magnitude and phase of harmonic transfer functions, the principal ones at once, and what `more` there is to say."""
    drawn = sorted((f for f in functions if len(f.frequency) > 1), key=lambda f: (abs(f.m), f.m))
    if not drawn:
        return Section("Transfer functions", (Paragraph("None could be estimated from these records."),))
    first = [f for f in drawn if abs(f.m) <= SHOWN]
    blocks: list[Block] = [
        Paragraph(
            "On its limit cycle the machine answers a small input at one frequency at that frequency (G₀) and at frequencies "
            "shifted by multiples of the pumping frequency (G₊₁, G₋₁, …)."
        ),
        transfer_grid(first, unit),
    ]
    further = [f for f in drawn if abs(f.m) > SHOWN]
    if further:
        blocks.append(Fold("Further harmonics", (transfer_grid(further, unit),)))
    return Section("Transfer functions", (*blocks, *more))


def _missing(result: Mapping[str, Any]) -> tuple[Block, ...]:
    """Conditions of transfer functions, or of the paper's method, that fail here."""
    about, methods = result.get("transfer_functions") or {}, result.get("methods") or {}
    missing, paper = about.get("missing"), methods.get("paper_missing")
    lacks = [missing, f"the paper's method is not used: {paper}" if paper and paper != missing else None]
    return tuple(Paragraph(sentence(text), "note") for text in lacks if text)


def _errors(result: Mapping[str, Any], unit: str) -> tuple[Block, ...]:
    """Method of the transfer functions, and the size of each kind of error in each of them."""
    about = result.get("transfer_functions") or {}
    method = FOUND_BY.get(about.get("method") or "")
    functions = [
        one for one in result.get("harmonics") or () if one.get("noise") is not None and one["frequency"]
    ]
    if method is None or not functions:
        return ()
    p_values = {test["m"]: test["p_value"] for test in about.get("tested") or ()}
    rows = []
    for one in sorted(functions, key=lambda one: (abs(one["m"]), one["m"])):
        p_value = p_values.get(abs(one["m"]))
        rows.append(
            (
                harmonic_name(one["m"]), _size(one["magnitude"], max, unit),
                *(_size(one[key], _rms, unit) for key in LEVELS), probability(p_value),
            )
        )  # fmt: skip
    words = method
    if p_values:
        words += f" As many harmonics are shown as stand out of the errors, at a rate of false alarms of {percent(about['false_alarm'])}."
    caption = (
        "Errors by their cause, as rms over frequency: distortion of even and odd order, and what harmonics beyond those shown "
        "may add. A dash: this excitation cannot tell. The last column is the probability that noise alone would show as much."
    )
    heads = ("function", "peak", "all errors", "noise", "even", "odd", "aliasing", "chance")
    return (Paragraph(words), Table(caption, heads, tuple(rows)))


def _rms(values: Sequence[float]) -> float:
    return float(np.sqrt(np.mean(np.square(values))))


def _size(values: Sequence[float | None], of: Callable[[Sequence[float]], float], unit: str) -> str:
    known = [value for value in values if value is not None and np.isfinite(value)]
    if not known:
        return NONE
    factor, label = scaled_ratio(of(known), unit)
    return with_unit(number(factor * of(known), 2), label)


def _paper(result: Mapping[str, Any]) -> tuple[Section, ...]:
    methods = (result.get("methods") or {}).get("paper") or {}
    if not methods:
        return ()
    rows = tuple((f"from {_harmonic(name)} alone", *_triple(found)) for name, found in methods.items())
    table = Table(
        "Delays from the phase of one transfer function at a time. G₀ shows the sum only.",
        ("estimate", "input delay", "measurement delay", "sum"),
        rows,
    )
    return (Section("Delays from single transfer functions", (table,)),)


def _harmonic(name: str) -> str:
    return name.replace("G0", "G₀").replace("G-1", "G₋₁").replace("G+1", "G₊₁")


def _triple(found: Mapping[str, float]) -> tuple[str, str, str]:
    """Input, measurement and sum in milliseconds."""
    known = dict(found)
    if "sum" not in known and {"input", "measurement"} <= set(known):
        known["sum"] = known["input"] + known["measurement"]
    first, second, total = (_milliseconds(known.get(key)) for key in ("input", "measurement", "sum"))
    return first, second, total


def _milliseconds(value: float | None) -> str:
    return NONE if value is None else with_unit(f"{1e3 * value:.2f}".replace("-", "−"), "ms")


def _remarks(result: Mapping[str, Any]) -> Section:
    quality = result.get("quality") or {}
    lines = [
        f"In free run the identified model's error is {percent(quality.get('nrmse'))} of the motion's standard deviation."
    ]
    for one in (result.get("held_out") or {}).get("records") or ():
        told = f"the error is {percent(one['nrmse'])} of the motion's standard deviation"
        missing = f"the model could not be run ({one['missing']})"
        lines.append(f"Of the held-out record {one['record']} {missing if one['nrmse'] is None else told}.")
    lines += [f"{sentence(one['text'])} {one['question']}" for one in result.get("warnings") or ()]
    lines += [sentence(str(note)) for note in result.get("notes") or ()]
    return Section("How far to trust this", (Bullets(tuple(lines)),))


def comparison_section(
    experiments: Sequence[Mapping[str, Any]], names: Sequence[str] | None = None
) -> Section:
    """Actual and estimated delays of several experiments, in the manner of the paper's Table 1.

    `experiments` are results of `identify --json` with their "actual" delays added, as `table1 --json` lists them.
    """
    rows, worst = [], 0.0
    for index, one in enumerate(experiments):
        actual, methods, delays = one["actual"], one["methods"]["paper"], one["delays"]
        row = [names[index] if names else f"experiment {index + 1}", _pair(actual)]
        row += [_pair(methods.get(key) or {}) for key in METHODS]
        rows.append(
            (*row, f"{told(delays['input'], MILLISECONDS)} / {told(delays['measurement'], MILLISECONDS)}")
        )
        for key in ("input", "measurement"):
            value = (delays.get(key) or {}).get("value")
            if value is not None:
                worst = max(worst, abs(value - actual[key]))
    return Section(
        "Delays in all experiments",
        (
            Paragraph(f"The largest error of the final estimates is {_milliseconds(worst)}."),
            Table(
                "Input delay / measurement delay. G₀ alone shows only their sum. The last column is the final estimate, with 95 % "
                "intervals.",
                ("experiment", "actual", "from G₀ (sum)", "from G₋₁", "from G₊₁", "all together"),
                tuple(rows),
            ),
        ),
    )


def _pair(found: Mapping[str, float]) -> str:
    """Two delays in milliseconds, or their sum if only the sum is known."""
    if "input" in found and "measurement" in found:
        return f"{1e3 * found['input']:.1f} / {1e3 * found['measurement']:.1f} ms".replace("-", "−")
    return _milliseconds(found.get("sum"))
