"""`rhythmid diagnose`: which physics the nominal model lacks."""

from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console
from rich.table import Table

from rhythmid.commands.options import Bags, Elements, JsonFile, ReportFile, SignalsFile, command_line
from rhythmid.output import require_new, write_json

Model_ = Annotated[Path, typer.Option("--model", help="Nominal model, the one that may lack something.")]


def diagnose(
    bags: Bags,
    model: Model_,
    signals: SignalsFile = None,
    holdout: Annotated[
        list[Path] | None, typer.Option("--holdout", help="Records to judge by only; may be repeated.")
    ] = None,
    elements: Elements = None,
    json: JsonFile = None,
    report: ReportFile = None,
    save_model: Annotated[Path | None, typer.Option("--save-model", help="Write the augmented model.")] = None,
) -> None:
    """Say where records and model part, which physics the model lacks, and how much better it fits with it."""
    from rhythmid.diagnose.diagnosis import diagnose as find
    from rhythmid.elements.catalogue import load_catalogue
    from rhythmid.model import Model
    from rhythmid.record.read import load_records

    for path in (json, report, save_model):
        require_new(path)
    catalogue = load_catalogue(elements or ())
    nominal = Model.load(model, catalogue)
    records = load_records(bags, signals)
    unseen = load_records(holdout or (), signals)
    console = Console(stderr=True)
    with console.status("reading") as status:

        def tell(what: str) -> None:
            status.update(what)
            console.print(f"[dim]{what}[/]")

        answer = find(records, nominal, unseen, catalogue, tell)
    show(answer.diagnosis.to_dict())
    if json is not None:
        write_json(json, answer.diagnosis.to_dict())
    if save_model is not None:
        answer.model.save(save_model)
    if report is not None:
        from rhythmid.diagnose.present import present
        from rhythmid.report.page import write_page

        write_page(report, present(answer, nominal, records, unseen, command_line(), model.name))
        typer.echo(f"report: {report}")


def show(result: dict) -> None:
    """Print a diagnosis."""
    console = Console()
    console.print(f"[bold]{result['verdict'].replace('_', ' ')}[/]: {result['summary']}")
    where = result["location"]
    console.print(f"where: {where['where']}")
    for effect in result["missing"]:
        table = Table(title=f"{effect['element']}   {effect['equation']}   ({100 * effect['probability']:.0f} %)")
        for column in ("parameter", "value", "std", "unit"):
            table.add_column(column)
        for name, value in effect["parameters"].items():
            std = "—" if value["std"] is None else f"{value['std']:.2g}"
            table.add_row(name, f"{value['value']:.6g}", std, value["unit"])
        console.print(table)
    for group in result["indistinguishable"]:
        console.print(f"indistinguishable here: {', '.join(group)}")
    for name, fit in result["fit"].items():
        held = "—" if fit["heldout_nrmse"] is None else f"{fit['heldout_nrmse']:.5f}"
        console.print(f"{name.replace('_', ' ')}: NRMSE {fit['train_nrmse']:.5f} seen, {held} held out")
    for line in result["calibration"]:
        console.print(f"calibration: {line}")
    console.print(f"next experiment: {result['next_experiment']}")
