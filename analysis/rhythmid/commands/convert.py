"""`rhythmid convert`: a table as a bag."""

from pathlib import Path
from typing import Annotated, Any

import typer

from rhythmid.commands.options import JsonFile, Quiet, SignalsFile
from rhythmid.commands.terminal import Terminal
from rhythmid.errors import InputError
from rhythmid.output import require_new, write_json

EXAMPLES = (
    "rhythmid convert run.csv --out bag",
    "rhythmid convert run.mat --signals signals.yaml --joint knee --out bag",
)


def convert(
    table: Annotated[
        Path,
        typer.Argument(help="Table (.csv, .mat, .npz, .parquet, …), or a signals.yaml that names tables."),
    ],
    out: Annotated[Path, typer.Option("--out", help="Bag to write: a new folder.")],
    signals: SignalsFile = None,
    joint: Annotated[str, typer.Option("--joint", help="Name of the joint in the messages.")] = "joint",
    rate: Annotated[
        float | None,
        typer.Option("--rate", metavar="HZ", help="Sample rate of the table, if it has no column of times."),
    ] = None,
    json: JsonFile = None,
    quiet: Quiet = False,
) -> None:
    """Write a table as a rosbag2 (MCAP) of joint states, with a signals.yaml inside that reads it back.

    Without --signals the columns are guessed in the same way as by `rhythmid init`, and the guesses are printed.
    """
    from rhythmid.record.bag import is_bag
    from rhythmid.record.convert import write_record
    from rhythmid.record.read import read_record
    from rhythmid.record.signals import Signals
    from rhythmid.start.start import guess

    require_new(out, json)
    terminal = Terminal(quiet, json)
    if is_bag(table):
        raise InputError(f"{table}: is a bag already; convert takes a table")
    told: dict[str, Any] = {}
    if signals is None and table.suffix not in (".yaml", ".yml"):
        guessed = guess(table, rate=rate)
        told = guessed.to_dict()
        for line in guessed.lines():
            terminal.say(line)
        record = read_record(table, Signals.from_text(guessed.signals))
    else:
        record = read_record(table, signals)
    write_record(record, out, joint)
    terminal.say(f"{out}: {', '.join(record.channels)}; read it with --signals {out / 'signals.yaml'}")
    if json is not None:
        samples = {role: len(channel) for role, channel in record.channels.items()}
        files = {"path": str(out), "signals": str(out / "signals.yaml")}
        write_json(json, {**files, "joint": joint, "samples": samples, "guessed": told})
