"""Print a design."""

from collections.abc import Mapping
from typing import Any

from rich.console import Console

from rhythmid.report.terminal_table import print_estimates


def show(result: Mapping[str, Any], console: Console) -> None:
    """Print a design from its JSON data."""
    rows = result["parameters"] | {f"delay: {name}": estimate for name, estimate in result["delays"].items()}
    print_estimates(console, "predicted standard deviations", rows, "name")
    size, position, signal, bent = (result[key] for key in ("amplitude", "position", "signal", "distortion"))
    console.print(
        f"{result['kind']}: {len(signal['frequencies'])} lines, peak {size['peak']:.4g} {size['unit']} "
        f"(limit: {size['limited_by']}), rms {size['rms']:.4g}, crest factor {size['crest_factor']:.2f}"
    )
    forcing = result["forcing"]
    forced = forcing["amplitude"] != 0.0
    console.print(
        f"forcing of {forcing['amplitude']:g} {size['unit']} at {forcing['frequency']:g} Hz, part of the plan: the machine moves in "
        "the limit cycle that it causes"
        if forced
        else "no forcing: without a command the machine rests"
    )
    low, high = position["cycle"]
    console.print(
        f"position {position['low']:.6g} to {position['high']:.6g} {position['unit']}, "
        f"{'the limit cycle alone' if forced else 'without command'} {low:.6g} to {high:.6g}"
    )
    apart = f"; harmonics up to ±{signal['harmonics']} stay apart" if forced else ""
    console.print(
        f"repeats over {signal['window']:.6g} s after a lead-in of {signal['lead_in']:.4g} s{apart}"
    )
    console.print(f"distortion of the response: even {bent['even']:.2%}, odd {bent['odd']:.2%}")
    for note in result["notes"]:
        console.print(f"note: {note}", markup=False)
