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
    joint: Annotated[
        str | None,
        typer.Option("--joint", help="Name of the joint in the messages; one joint is written then."),
    ] = None,
    rate: Annotated[
        float | None,
        typer.Option("--rate", metavar="HZ", help="Sample rate of the table, if it has no column of times."),
    ] = None,
    json: JsonFile = None,
    quiet: Quiet = False,
) -> None:
    """Write a table as a rosbag2 (MCAP) of joint states, with a signals.yaml inside that reads it back.

    Without --signals the columns are guessed in the same way as by `rhythmid init`, and the guesses are printed. All joints of a
    table, guessed or named by the signals, are in one topic.
    """
    from rhythmid.record.bag import is_bag
    from rhythmid.record.convert import write_record
    from rhythmid.record.convert_joints import write_joint_record
    from rhythmid.record.joint_record import JointRecord, JointSignals, names_joints, read_joint_record
    from rhythmid.record.read import read_record
    from rhythmid.record.signals import Signals
    from rhythmid.start.start import guess
    from rhythmid.start.table_joints import guessed_joints

    require_new(out, json)
    terminal = Terminal(quiet, json)
    if is_bag(table):
        raise InputError(f"{table}: is a bag already; convert takes a table")
    told: dict[str, Any] = {}
    named = signals or (table if table.suffix in (".yaml", ".yml") else None)
    if named is not None and names_joints(named):
        if joint is not None:
            raise InputError(f"{named}: names its joints; leave --joint out")
        record = read_joint_record(table, JointSignals.load(named))
    elif named is not None:
        record = read_record(table, signals)
    else:
        guessed = guess(table, rate=rate)
        told = guessed.to_dict()
        record = read_record(table, Signals.from_text(guessed.signals))
        if guessed.roles.joint.others and joint is None:
            record, lines = guessed_joints(table, guessed, rate)
            told = {"joints": list(record.joints), "roles": lines}
        else:
            lines = guessed.lines()
        for line in lines:
            terminal.say(line)
    of: dict[str, Any]
    if isinstance(record, JointRecord):
        write_joint_record(record, out)
        roles = dict.fromkeys(role for one in record.joints.values() for role in one.channels)
        parts = record.every.items()
        samples = {f"{name}.{role}": len(one) for name, part in parts for role, one in part.channels.items()}
        what = f"{len(record.joints)} joints ({', '.join(record.joints)}): {', '.join(roles)}"
        of = {"joints": list(record.joints)}
    else:
        of = {"joint": joint or "joint"}
        write_record(record, out, of["joint"])
        samples = {role: len(channel) for role, channel in record.channels.items()}
        what = ", ".join(samples)
    terminal.say(f"{out}: {what}; read it with --signals {out / 'signals.yaml'}")
    if json is not None:
        files = {"path": str(out), "signals": str(out / "signals.yaml")}
        write_json(json, {**files, **of, "samples": samples, "guessed": told})
