"""`rhythmid identify`: parameters, delays and harmonic transfer functions from records."""

from pathlib import Path
from typing import Annotated, cast, get_args

import typer

from rhythmid.commands import machines
from rhythmid.commands.options import (
    Bags,
    Elements,
    Holdout,
    JsonFile,
    Quiet,
    ReportFile,
    SignalsFile,
    command_line,
)
from rhythmid.commands.terminal import Terminal
from rhythmid.errors import InputError
from rhythmid.output import require_new, write_json

EXAMPLES = (
    "rhythmid identify bag --model model.yaml",
    "rhythmid identify a b --signals signals.yaml --model model.yaml --holdout c --report page.html",
    "rhythmid identify bag --quiet --json -",
)


def identify(
    bags: Bags,
    model: Annotated[
        Path | None,
        typer.Option("--model", help="Model file of the machine; the paper's hopper by default."),
    ] = None,
    signals: SignalsFile = None,
    holdout: Holdout = None,
    elements: Elements = None,
    json: JsonFile = None,
    report: ReportFile = None,
    save_model: Annotated[
        Path | None, typer.Option("--save-model", help="Write the identified model.")
    ] = None,
    save: Annotated[
        Path | None, typer.Option("--save", help="Write the delays and the model for use in a controller.")
    ] = None,
    method: Annotated[
        str | None,
        typer.Option(
            "--method", help="joint (maximum likelihood, the default) or paper (magnitudes, then phases)."
        ),
    ] = None,
    htf: Annotated[
        str | None,
        typer.Option(
            "--htf",
            help="Estimator of the transfer functions: auto (as the excitation allows, the default), separated_lines, "
            "local_rational or regularised_least_squares (the paper's).",
        ),
    ] = None,
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
        typer.Option("--clock-offset", help="Bounds of that clock's offset in s, with clock_unknown."),
    ] = None,
    clock_offset_std: Annotated[
        float | None,
        typer.Option(
            "--clock-offset-std", help="Or the standard deviation of that offset in s, about zero.", min=0.0
        ),
    ] = None,
    quiet: Quiet = False,
) -> None:
    """Find a model's parameters, the command and measurement delays, and the harmonic transfer functions."""
    from rhythmid.elements.catalogue import load_catalogue
    from rhythmid.identify.identifiability import Forcing, offset_of
    from rhythmid.identify.identify import Method
    from rhythmid.identify.identify import identify as find
    from rhythmid.identify.latency import save_latency
    from rhythmid.ltp.nonparametric import HtfMethod
    from rhythmid.model import Model
    from rhythmid.progress_bar import progress
    from rhythmid.record.read import load_records

    require_new(json, report, save_model, save)
    terminal = Terminal(quiet, json)
    if model is not None and machines.is_machine(model):
        machines.refuse(
            save=save, forcing=forcing, clock_offset=clock_offset, clock_offset_std=clock_offset_std,
            method=method, htf=htf,
        )  # fmt: skip
        machines.identify_files(
            bags, model, signals, holdout or (), elements or (), json, report, save_model, terminal
        )
        return
    method, htf = method or "joint", htf or "auto"
    _check("method", method, get_args(Method))
    _check("htf", htf, get_args(HtfMethod))
    _check("forcing", forcing, get_args(Forcing))
    offset = offset_of(clock_offset, clock_offset_std)
    if offset is not None and forcing not in (None, "clock_unknown"):
        raise InputError(
            f"--clock-offset says that the forcing's clock is unknown, --forcing {forcing} that it is known"
        )
    known = None if model is None else Model.load(model, load_catalogue(elements or ()))
    with progress(terminal.progress) as tell:
        records = load_records(bags, signals, tell)
        unseen = load_records(holdout or (), signals, tell)
        path = "clock_unknown" if offset is not None else cast(Forcing | None, forcing)
        found = find(
            records, known, method=cast(Method, method), forcing=path, offset=offset, htf=cast(HtfMethod, htf),
            tell=tell, holdout=unseen,
        )  # fmt: skip
    found.show(terminal.answer)
    if json is not None:
        write_json(json, found.to_dict())
    if save_model is not None:
        found.model.save(save_model)
    if save is not None and found.usable:
        save_latency(found, save)
    elif save is not None:
        terminal.say(f"{save}: not written, for no controller should use this fit")
    if report is not None:
        from rhythmid.identify.present import present

        name = "the paper's hopper" if model is None else model.name
        terminal.report(report, present(found, command_line(), name))


def _check(option: str, given: str | None, known: tuple[str, ...]) -> None:
    if given is not None and given not in known:
        raise InputError(f"--{option} {given}: one of {', '.join(known)} is expected")
