"""Prints an identification on the terminal."""

from collections.abc import Mapping
from typing import Any

from rich.console import Console
from rich.markup import escape

from rhythmid.report.quantity import averaged_words, number, rounded
from rhythmid.report.terminal_table import print_estimates


def show(result: Mapping[str, Any], console: Console) -> None:
    """Print an identification from its JSON data, cautions first."""
    for warning in result["warnings"]:
        console.print(f"[bold]{escape(warning['text'])}[/]")
        console.print(f"  {escape(warning['question'])}")
    delays = result["delays"]
    rows = result["parameters"] | {f"delay: {name}": delays[name] for name in ("input", "measurement", "sum")}
    title = "parameters and delays" + ("" if result["usable"] else " of a fit that is not usable")
    print_estimates(console, title, rows, "name")
    console.print(f"assumption: {delays['assumption']}")
    if delays["closure"]["z"] is not None:
        console.print(
            f"closure (phase of the cycle + offset of the sidebands − slope): {delays['closure']['z']:+.2f} standard deviations"
        )
    for name, (low, high) in (delays["intervals"] or {}).items():
        console.print(f"{name} delay: between {1e3 * low:.3f} and {1e3 * high:.3f} ms (95 %)")
    for first, second in delays["aliases"]:
        console.print(
            f"the same record is given by {1e3 * first:.2f} ms (input) and {1e3 * second:.2f} ms (measurement)"
        )
    for label, one in delays["inner"].items():
        for other, total in one["sums"].items():
            told = rounded(1e3 * total["value"], 1e3 * total["std"])
            std = rounded(1e3 * total["std"], 1e3 * total["std"])
            console.print(f"{label} + {other}: {told} ± {std} ms")
    for words in delays["undetermined"]:
        console.print(f"not determined: {words}")
    _show_transfer_functions(result, console)
    quality = result["quality"]
    of = averaged_words(quality.get("averaged", 1))
    console.print(
        f"{quality['rate']:.6g} Hz, {quality['gaps']} gaps of the output, free-run NRMSE {number(quality['nrmse'], 3)}{of}"
    )
    _show_held_out(result.get("held_out"), console)
    for note in result["notes"]:
        console.print(f"note: {note}", markup=False)


def _show_held_out(held_out: Mapping[str, Any] | None, console: Console) -> None:
    """Print the error on held-out records, in all and record by record, or why there is none."""
    if held_out is None:
        return
    records = held_out["records"]
    if held_out["nrmse"] is not None:
        console.print(f"held out: free-run NRMSE {number(held_out['nrmse'], 3)}")
    for one in records if len(records) > 1 or held_out["nrmse"] is None else ():
        told = (
            f"no free run: {one['missing']}" if one["nrmse"] is None else f"NRMSE {number(one['nrmse'], 3)}"
        )
        console.print(f"held out, {one['record']}: {told}", markup=False)


def _show_transfer_functions(result: Mapping[str, Any], console: Console) -> None:
    """Print the results of the paper's method and the transfer functions, or in one line the missing conditions."""
    methods, about = result["methods"], result["transfer_functions"]
    for name, estimates in methods["paper"].items():
        told = ", ".join(f"{which} {1e3 * value:.2f} ms" for which, value in estimates.items())
        console.print(f"paper's method, {name}: {told}")
    if result["harmonics"]:
        highest = max(one["m"] for one in result["harmonics"])
        console.print(f"transfer functions up to ±{highest}, by {about['method'].replace('_', ' ')}")
    if about["missing"] is not None:
        console.print(f"no transfer functions: {about['missing']}", markup=False)
    if methods["paper_missing"] not in (None, about["missing"]):
        console.print(f"paper's method not shown: {methods['paper_missing']}", markup=False)
