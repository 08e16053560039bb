"""`rhythmid diagnose`: which physics the nominal model lacks."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.console import Console
from rich.table import Table

from rhythmid.commands.options import Bags, Elements, JsonFile, ReportFile, SignalsFile, command_line
from rhythmid.errors import InputError
from rhythmid.output import require_new, write_json

if TYPE_CHECKING:
    from rhythmid.record.record import Record

Model_ = Annotated[
    Path | None, typer.Option("--model", help="Nominal model, the one that may lack something.")
]


def diagnose(
    bags: Bags,
    model: Model_ = None,
    signals: SignalsFile = None,
    sim: Annotated[
        Path | None,
        typer.Option(
            "--sim", help="Record of a simulation to compare with directly; enough without a model."
        ),
    ] = None,
    sim_signals: Annotated[
        Path | None,
        typer.Option(
            "--sim-signals",
            help="Which channel of --sim is what; by default as --signals, or our own topics.",
        ),
    ] = None,
    holdout: Annotated[
        list[Path] | None, typer.Option("--holdout", help="Records to judge by only; may be repeated.")
    ] = None,
    elements: Elements = None,
    json: JsonFile = None,
    report: ReportFile = None,
    save_model: Annotated[
        Path | None, typer.Option("--save-model", help="Write the augmented model.")
    ] = None,
) -> None:
    """Say where records and model part, which physics the model lacks, and how much better it fits with it.

    With --sim, first where a simulation's record and the real one part; without --model, only that.
    """
    from rhythmid.elements.catalogue import load_catalogue
    from rhythmid.model import Model
    from rhythmid.record.read import load_records

    require_new(json, report, save_model)
    if model is None and sim is None:
        raise InputError("nothing to compare the records with: give --model NOMINAL.yaml, --sim BAG, or both")
    if model is None and (holdout or save_model):
        raise InputError("--holdout and --save-model belong to a model: give --model NOMINAL.yaml too")
    catalogue = load_catalogue(elements or ())
    nominal = None if model is None else Model.load(model, catalogue)
    records = load_records(bags, signals)
    unseen = load_records(holdout or (), signals)
    simulation = None if sim is None else _simulation(sim, signals, sim_signals)
    console = Console(stderr=True)
    result, answer, comparison = {}, None, None
    with console.status("reading") as status:

        def tell(what: str) -> None:
            status.update(what)
            console.print(f"[dim]{what}[/]")

        if simulation is not None:
            from rhythmid.compare.compare import compare

            comparison = compare(simulation, records, nominal, tell)
            result["comparison"] = comparison.to_dict()
            show_comparison(result["comparison"])
        if nominal is not None:
            from rhythmid.diagnose.diagnosis import diagnose as find

            answer = find(records, nominal, unseen, catalogue, tell)
            result = answer.diagnosis.to_dict() | result
    if answer is not None:
        show(result)
    if json is not None:
        write_json(json, result)
    if save_model is not None and answer is not None:
        answer.model.save(save_model)
    if report is not None:
        from rhythmid.diagnose.answer.present import present, present_comparison
        from rhythmid.report.page import write_page

        if answer is not None and nominal is not None and model is not None:
            page = present(answer, nominal, records, unseen, command_line(), model.name, comparison)
        else:
            assert comparison is not None and simulation is not None
            page = present_comparison(comparison, simulation, records, command_line())
        write_page(report, page)
        typer.echo(f"report: {report}")


def _simulation(path: Path, signals: Path | None, own: Path | None) -> "Record":
    """The simulation's record. Without signals of its own it may have the recording's channels, or the topics of our nodes."""
    from rhythmid.record.read import read_record

    if own is not None or signals is None:
        return read_record(path, own)
    try:
        return read_record(path, signals)
    except InputError as error:
        try:
            return read_record(path)
        except InputError:
            raise error from None


def show_comparison(result: dict) -> None:
    """Print a comparison."""
    console = Console()
    alignment = result["alignment"]
    offset = alignment["offset"]
    console.print(
        f"[bold]{result['simulation']}[/] against [bold]{result['recording']}[/]: aligned by the {alignment['by']}, the "
        f"recording is {offset['value']:.6f} ± {2.0 * offset['std']:.2g} s later; {result['overlap']['value']:.4g} s in common"
    )
    console.print(result["summary"])
    for note in result["notes"]:
        console.print(f"note: {note}")


def show(result: dict) -> None:
    """Print a diagnosis."""
    console = Console()
    console.print(f"[bold]{result['verdict'].replace('_', ' ')}[/]: {result['summary']}")
    where = result["location"]
    console.print(f"where: {where['where']}")
    for effect in result["missing"]:
        table = Table(
            title=f"{effect['element']}   {effect['equation']}   ({100 * effect['probability']:.0f} %)"
        )
        for column in ("parameter", "value", "std", "unit"):
            table.add_column(column)
        for name, value in effect["parameters"].items():
            std = "—" if value["std"] is None else f"{value['std']:.2g}"
            table.add_row(name, f"{value['value']:.6g}", std, value["unit"])
        console.print(table)
    for group in result["indistinguishable"]:
        console.print(f"indistinguishable here: {', '.join(group)}")
    if result["scoring"] != "free run":
        console.print(f"scored in {result['scoring']}")
    for name, fit in result["fit"].items():
        held = "—" if fit["heldout_nrmse"] is None else f"{fit['heldout_nrmse']:.5f}"
        console.print(f"{name.replace('_', ' ')}: NRMSE {fit['train_nrmse']:.5f} seen, {held} held out")
    for line in result["calibration"]:
        console.print(f"calibration: {line}")
    for line in result["excluded"]:
        console.print(f"excluded: {line}")
    for line in result["notes"]:
        console.print(f"note: {line}")
    console.print(f"next experiment: {result['next_experiment']}")
