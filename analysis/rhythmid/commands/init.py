"""`rhythmid init`: looks at a recording and writes the two files that describe it."""

import math
import shlex
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

import typer

from rhythmid.commands.options import Elements, JsonFile, Quiet
from rhythmid.commands.terminal import Terminal
from rhythmid.errors import InputError
from rhythmid.output import STANDARD_OUTPUT, require_new, require_writable, write_json, write_text

EXAMPLES = (
    "rhythmid init run.csv",
    "rhythmid init bag --joint knee --out files --yes",
    "rhythmid init bag --body robot.urdf",
    "rhythmid init run.csv --role output=theta --role input=u --unit theta=deg",
)


def init(
    sources: Annotated[
        list[Path],
        typer.Argument(help="Bags or tables of one layout; roles are guessed from the first one that moves."),
    ],
    out: Annotated[Path, typer.Option("--out", help="Folder for signals.yaml and model.yaml.")] = Path(),
    joint: Annotated[
        str | None, typer.Option("--joint", help="Joint to use; by default the one that moves most.")
    ] = None,
    body: Annotated[
        Path | None,
        typer.Option("--body", help="MJCF or URDF file of a robot, all of whose recorded joints are meant."),
    ] = None,
    rate: Annotated[
        float | None,
        typer.Option("--rate", metavar="HZ", help="Sample rate of a table, if it has no column of times."),
    ] = None,
    role: Annotated[
        list[str] | None,
        typer.Option(
            "--role",
            metavar="ROLE=CHANNEL",
            help="What a channel is, instead of a guess: output (the measured motion), input (the force that drives), reference, base or "
            "forcing; may be repeated.",
        ),
    ] = None,
    unit: Annotated[
        list[str] | None,
        typer.Option(
            "--unit", metavar="CHANNEL=UNIT", help="Unit of a channel, such as theta=deg; may be repeated."
        ),
    ] = None,
    yes: Annotated[
        bool, typer.Option("--yes", "--no-input", help="Take the best guess for everything, without asking.")
    ] = False,
    force: Annotated[bool, typer.Option("--force", help="Overwrite files that exist.")] = False,
    elements: Elements = None,
    json: JsonFile = None,
    quiet: Quiet = False,
) -> None:
    """Guess what each channel is and a first nominal model; write both, every guess with its reason."""
    from rhythmid.elements.catalogue import load_catalogue

    if rate is not None and not (math.isfinite(rate) and rate > 0.0):
        raise InputError("--rate is a number of rows a second, greater than 0")
    signals, model = out / "signals.yaml", out / "model.yaml"
    require_new(json)
    for path in (signals, model):
        require_writable(path) if force else require_new(path)
    if body is not None and joint is not None:
        raise InputError("--joint is one joint, --body are all of a robot; give one of the two")
    if body is not None and (role or unit):
        raise InputError(
            "--role and --unit are for a machine of one joint; with --body the channels are found by their names"
        )
    known = load_catalogue(elements or ())
    if body is not None:
        from rhythmid.start.robot import start_robot

        begun = start_robot(sources, body, out, rate, known)
    else:
        from rhythmid.start.roles import first_answer
        from rhythmid.start.start import start
        from rhythmid.start.stated import Stated

        asking = not yes and not quiet and json != STANDARD_OUTPUT and sys.stdin.isatty()
        said = Stated.of(role or (), unit or ())
        begun = start(sources, joint, rate, _prompt if asking else first_answer, known, said)
    write_text(signals, begun.signals)
    write_text(model, begun.model)
    terminal = Terminal(quiet, json)
    for line in begun.lines():
        terminal.say(line)
    terminal.say(f"{signals}, {model}: every guess is a comment there; go on with")
    with_signals = ["--signals", str(signals)]
    terminal.say(f"  {shlex.join(['rhythmid', 'check', *map(str, sources), *with_signals])}")
    diagnosis = ["rhythmid", "diagnose", *map(str, sources), *with_signals, "--model", str(model)]
    terminal.say(f"  {shlex.join(diagnosis)}")
    if json is not None:
        write_json(json, {"files": {"signals": str(signals), "model": str(model)}, **begun.to_dict()})


def _prompt(question: str, answers: Sequence[str]) -> int:
    """Ask on the terminal; the first answer is the default."""
    typer.echo(question)
    for number, answer in enumerate(answers, start=1):
        typer.echo(f"  {number}  {answer}")
    while not 1 <= (number := typer.prompt("number", default=1, type=int)) <= len(answers):
        typer.echo(f"a number from 1 to {len(answers)} is expected")
    return number - 1
