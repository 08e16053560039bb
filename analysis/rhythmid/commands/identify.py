"""`rhythmid identify`: parameters, delays and harmonic transfer functions from records."""

from pathlib import Path
from typing import Annotated, Any, cast, get_args

import typer
from rich.console import Console
from rich.markup import escape
from rich.table import Table

from rhythmid.commands import machines
from rhythmid.commands.options import Bags, Elements, JsonFile, ReportFile, SignalsFile, command_line
from rhythmid.output import require_new, write_json
from rhythmid.report.quantity import rounded


def identify(
    bags: Bags,
    model: Annotated[
        Path | None,
        typer.Option("--model", help="What is known of the machine; the paper's hopper by default."),
    ] = None,
    signals: SignalsFile = None,
    elements: Elements = None,
    json: JsonFile = None,
    report: ReportFile = None,
    save_model: Annotated[
        Path | None, typer.Option("--save-model", help="Write the identified model.")
    ] = None,
    save: Annotated[
        Path | None, typer.Option("--save", help="Write delays and model for a controller.")
    ] = None,
    method: Annotated[
        str, typer.Option("--method", help="joint (maximum likelihood) or paper (magnitudes, then phases).")
    ] = "joint",
    htf: Annotated[
        str,
        typer.Option(
            "--htf",
            help="How transfer functions are found: auto (as the excitation allows), separated_lines, "
            "local_rational or regularised_least_squares (the paper's).",
        ),
    ] = "auto",
    forcing: Annotated[
        str | None,
        typer.Option(
            "--forcing",
            help="How the forcing reaches the machine: on_robot, delayed (like the command) or "
            "clock_unknown (its phase was recorded by another clock).",
        ),
    ] = None,
    clock_offset: Annotated[
        tuple[float, float] | None,
        typer.Option("--clock-offset", help="Bounds, in s, of that clock's offset, where it is unknown."),
    ] = None,
    clock_offset_std: Annotated[
        float | None,
        typer.Option("--clock-offset-std", help="Or its standard deviation, in s, about zero.", min=0.0),
    ] = None,
) -> None:
    """Find a model's parameters, the command and measurement delays, and the harmonic transfer functions."""
    from rhythmid.elements.catalogue import load_catalogue
    from rhythmid.errors import InputError
    from rhythmid.identify.identifiability import Forcing, offset_of
    from rhythmid.identify.identify import Method
    from rhythmid.identify.identify import identify as find
    from rhythmid.identify.latency import save_latency
    from rhythmid.ltp.nonparametric import HtfMethod
    from rhythmid.model import Model
    from rhythmid.progress_bar import progress
    from rhythmid.record.read import load_records

    require_new(json, report, save_model, save)
    if model is not None and machines.is_machine(model):
        machines.refuse(report=report, save=save, forcing=forcing, clock_offset=clock_offset)
        machines.identify_files(bags, model, signals, elements or (), json, save_model)
        return
    if method not in get_args(Method):
        raise InputError(f"--method {method}: one of {', '.join(get_args(Method))} is expected")
    if htf not in get_args(HtfMethod):
        raise InputError(f"--htf {htf}: one of {', '.join(get_args(HtfMethod))} is expected")
    if forcing is not None and forcing not in get_args(Forcing):
        raise InputError(f"--forcing {forcing}: one of {', '.join(get_args(Forcing))} is expected")
    offset = offset_of(clock_offset, clock_offset_std)
    if offset is not None and forcing not in (None, "clock_unknown"):
        raise InputError(
            f"--clock-offset says that the forcing's clock is unknown, --forcing {forcing} that it is known"
        )
    known = None if model is None else Model.load(model, load_catalogue(elements or ()))
    with progress(Console(stderr=True)) as tell:
        tell("reading")
        records = load_records(bags, signals, tell)
        path = "clock_unknown" if offset is not None else cast(Forcing | None, forcing)
        found = find(
            records,
            known,
            method=cast(Method, method),
            forcing=path,
            offset=offset,
            htf=cast(HtfMethod, htf),
            tell=tell,
        )
    result = found.to_dict()
    show(result)
    if json is not None:
        write_json(json, result)
    if save_model is not None:
        found.model.save(save_model)
    if save is not None and found.usable:
        save_latency(found, save)
    elif save is not None:
        typer.echo(f"{save}: not written, for no controller should use this fit")
    if report is not None:
        from rhythmid.identify.present import present
        from rhythmid.report.page import write_page

        write_page(
            report, present(found, command_line(), "the paper's hopper" if model is None else model.name)
        )
        typer.echo(f"report: {report}")


def show(result: dict[str, Any]) -> None:
    """Print an identification: what casts doubt on it first."""
    console = Console()
    for warning in result["warnings"]:
        console.print(f"[bold]{escape(warning['text'])}[/]")
        console.print(f"  {escape(warning['question'])}")
    console.print(_estimates(result))
    delays = result["delays"]
    console.print(f"assuming that {delays['assumption']}")
    if delays["closure"]["z"] is not None:
        console.print(
            f"closure of phase, offset and slope: {delays['closure']['z']:+.2f} standard deviations"
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
            console.print(f"{label} + {other}: {told} ± {1e3 * total['std']:.2g} ms")
    for words in delays["undetermined"]:
        console.print(f"not determined: {words}")
    _show_transfer_functions(result, console)
    quality = result["quality"]
    console.print(f"{quality['rate']:.6g} Hz, {quality['gaps']} gaps, free-run NRMSE {quality['nrmse']:.5f}")
    for note in result["notes"]:
        console.print(f"note: {note}", markup=False)


def _estimates(result: dict[str, Any]) -> Table:
    """Parameters and delays, each to the digits that its standard deviation bears."""
    table = Table(
        title="parameters and delays"
        if result["usable"]
        else "parameters and delays of a fit that is not usable"
    )
    for column in ("name", "value", "std", "unit"):
        table.add_column(column)
    delays = result["delays"]
    rows = result["parameters"] | {f"delay: {name}": delays[name] for name in ("input", "measurement", "sum")}
    for name, estimate in rows.items():
        value, std = estimate["value"], estimate["std"]
        table.add_row(
            name,
            "not identifiable" if value is None or std is None else rounded(value, std),
            "—" if std is None else f"{std:.2g}",
            escape(estimate["unit"]),
        )
    return table


def _show_transfer_functions(result: dict[str, Any], console: Console) -> None:
    """The paper's method and what was found of transfer functions, or in one line what they lack."""
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
