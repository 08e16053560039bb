"""`rhythmid identify`: parameters, delays and harmonic transfer functions from records."""

from pathlib import Path
from typing import Annotated, Any

import typer
from rich.console import Console
from rich.table import Table

from rhythmid.commands.options import Bags, Elements, JsonFile, SignalsFile
from rhythmid.output import require_new, write_json


def identify(
    bags: Bags,
    model: Annotated[
        Path | None, typer.Option("--model", help="What is known of the machine; the paper's hopper by default.")
    ] = None,
    signals: SignalsFile = None,
    elements: Elements = None,
    json: JsonFile = None,
    save_model: Annotated[Path | None, typer.Option("--save-model", help="Write the identified model.")] = None,
) -> None:
    """Find a model's parameters, the command and measurement delays, and the harmonic transfer functions."""
    from rhythmid.elements.catalogue import load_catalogue
    from rhythmid.identify.identify import identify as find
    from rhythmid.model import Model
    from rhythmid.record.read import load_records

    for path in (json, save_model):
        require_new(path)
    known = None if model is None else Model.load(model, load_catalogue(elements or ()))
    with Console(stderr=True).status("reading") as status:
        records = load_records(bags, signals)
        status.update("identifying")
        found = find(records, known)
    result = found.to_dict()
    show(result)
    if json is not None:
        write_json(json, result)
    if save_model is not None:
        found.model.save(save_model)


def show(result: dict[str, Any]) -> None:
    """Print an identification."""
    console = Console()
    table = Table(title="parameters and delays")
    for column in ("name", "value", "std", "unit"):
        table.add_column(column)
    delays = result["delays"]
    rows = result["parameters"] | {f"delay: {name}": delays[name] for name in ("input", "measurement", "sum")}
    for name, estimate in rows.items():
        value, std = estimate["value"], estimate["std"]
        table.add_row(
            name,
            "not to be had" if value is None else f"{value:.6g}",
            "—" if std is None else f"{std:.2g}",
            estimate["unit"],
        )
    console.print(table)
    console.print(f"assuming that {delays['assumption']}")
    if delays["closure"]["z"] is not None:
        console.print(f"closure of phase, offset and slope: {delays['closure']['z']:+.2f} standard deviations")
    for name, estimates in result["methods"]["paper"].items():
        told = ", ".join(f"{which} {1e3 * value:.2f} ms" for which, value in estimates.items())
        console.print(f"paper's method, {name}: {told}")
    quality = result["quality"]
    console.print(f"{quality['rate']:.6g} Hz, {quality['gaps']} gaps, free-run NRMSE {quality['nrmse']:.5f}")
    for note in result["notes"]:
        console.print(f"note: {note}")
