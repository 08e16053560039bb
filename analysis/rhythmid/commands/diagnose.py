"""`rhythmid diagnose`: which physics the nominal model lacks."""

import math
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

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

if TYPE_CHECKING:
    from rhythmid.record.record import Record

Model_ = Annotated[
    Path | None, typer.Option("--model", help="Nominal model, the one that may lack something.")
]

EXAMPLES = (
    "rhythmid diagnose bag --model model.yaml",
    "rhythmid diagnose a b --signals signals.yaml --model model.yaml --holdout c --report page.html --save-model better.yaml",
    "rhythmid diagnose real --sim simulated",
)


def diagnose(
    bags: Bags,
    model: Model_ = None,
    signals: SignalsFile = None,
    sim: Annotated[
        Path | None,
        typer.Option(
            "--sim", help="Record of a simulation to compare with directly; a model is then not required."
        ),
    ] = None,
    sim_signals: Annotated[
        Path | None,
        typer.Option(
            "--sim-signals",
            help="signals.yaml for --sim; by default that of --signals, else rhythmid's own topics.",
        ),
    ] = None,
    holdout: Holdout = None,
    elements: Elements = None,
    json: JsonFile = None,
    report: ReportFile = None,
    save_model: Annotated[
        Path | None, typer.Option("--save-model", help="Write the augmented model.")
    ] = None,
    budget: Annotated[
        float | None,
        typer.Option(
            "--budget",
            metavar="SECONDS",
            help="Wall-clock time in which an answer is due: 60 % of it for the search, the rest for what weighs its results; "
            "the answer says what was not tried. A --report takes longer.",
        ),
    ] = None,
    quiet: Quiet = False,
) -> None:
    """Say where records and model differ, which physics the model lacks, and how much adding it reduces the error.

    With --sim the simulation's record is first compared with the real one; without --model this comparison is all that is done.
    """
    from rhythmid.elements.catalogue import load_catalogue
    from rhythmid.model import Model
    from rhythmid.progress_bar import progress
    from rhythmid.record.read import load_records

    require_new(json, report, save_model)
    _check(model, sim, budget, bool(holdout or save_model or budget))
    terminal = Terminal(quiet, json)
    if model is not None and machines.is_machine(model):
        machines.refuse(sim=sim)
        machines.diagnose_files(
            bags, model, signals, holdout or (), elements or (), json, report, save_model, budget, terminal
        )
        return
    catalogue = load_catalogue(elements or ())
    nominal = None if model is None else Model.load(model, catalogue)
    with progress(terminal.progress) as tell:
        records = load_records(bags, signals, tell)
        unseen = load_records(holdout or (), signals, tell)
    simulation = None if sim is None else _simulation(sim, signals, sim_signals)
    result, answer, comparison = {}, None, None
    if simulation is not None:
        from rhythmid.compare.compare import compare

        with progress(terminal.progress) as tell:
            comparison = compare(simulation, records, nominal, tell)
        result["comparison"] = comparison.to_dict()
        comparison.show(terminal.answer)
    if nominal is not None:
        from rhythmid.diagnose.diagnosis import diagnose as find

        with progress(terminal.progress, budget) as tell:
            answer = find(records, nominal, unseen, catalogue, tell, budget)
        result = answer.to_dict() | result
        answer.show(terminal.answer)
    if json is not None:
        write_json(json, result)
    if save_model is not None and answer is not None:
        answer.model.save(save_model)
    if report is not None:
        from rhythmid.diagnose.answer.present import present, present_comparison

        with progress(terminal.progress) as tell:
            tell("drawing the report")
            if answer is not None and nominal is not None and model is not None:
                page = present(answer, nominal, records, unseen, command_line(), model.name, comparison)
            else:
                assert comparison is not None and simulation is not None
                page = present_comparison(comparison, simulation, records, command_line())
        terminal.report(report, page)


def _check(model: Path | None, sim: Path | None, budget: float | None, of_a_model: bool) -> None:
    """Raise InputError for options that do not go together; `of_a_model`: whether some are given that need a model."""
    if budget is not None and not (math.isfinite(budget) and budget > 0.0):
        raise InputError("--budget is a number of seconds greater than 0")
    if model is None and sim is None:
        raise InputError("nothing to compare the records with: give --model NOMINAL.yaml, --sim BAG, or both")
    if model is None and of_a_model:
        raise InputError(
            "--holdout, --budget and --save-model belong to a model: give --model NOMINAL.yaml too"
        )


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
