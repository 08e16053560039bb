"""The command `rhythmid`. Exit codes: 0 an answer was reached, 2 bad usage or bad input, 1 a failure of ours."""

import json
import math
import os
import sys
from importlib.metadata import entry_points
from pathlib import Path
from typing import Annotated, Any, NoReturn

import typer
from rich.console import Console
from rich.markup import escape

from rhythmid import __version__
from rhythmid.errors import InputError

app = typer.Typer(
    name="rhythmid",
    help="Identify rhythmic robots from their recordings, and name the physics that a model lacks.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
)
COMMAND_GROUP = "rhythmid.commands"
console = Console(stderr=True)

Bags = Annotated[list[Path], typer.Argument(help="Bag directories, .mcap/.db3 files, or signals.yaml files of tables.")]
SignalsFile = Annotated[Path | None, typer.Option("--signals", help="Which recorded channel is what.")]
JsonFile = Annotated[Path | None, typer.Option("--json", help="Write the result as JSON.")]
ReportFile = Annotated[Path | None, typer.Option("--report", help="Write a self-contained HTML page.")]
Elements = Annotated[
    list[Path] | None, typer.Option("--elements", help="Folder with elements of your own; may be repeated.")
]


def _version(show: bool) -> None:
    if show:
        typer.echo(f"rhythmid {__version__}")
        raise typer.Exit


@app.callback()
def _main(
    version: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="Print the version.")
    ] = False,
) -> None:
    pass


def require_new(path: Path | None) -> None:
    """Refuse, before any work, a result that would overwrite something or cannot be written."""
    if path is None:
        return
    if path.exists():
        raise InputError(f"{path}: exists already; name another file or remove it")
    folder = path.absolute().parent
    if not folder.is_dir():
        raise InputError(f"{path}: the folder {folder} does not exist")
    if not os.access(folder, os.W_OK):
        raise InputError(f"{path}: the folder {folder} is not writable")


def write_text(path: Path, text: str) -> None:
    """Write a result file whole or not at all."""
    partial = path.with_name(f".{path.name}.partial")
    try:
        partial.write_text(text, encoding="utf-8")
        os.replace(partial, path)
    except OSError as error:
        raise InputError(f"{path}: cannot be written: {error.strerror}") from None


def write_json(path: Path, content: Any) -> None:
    """Write a JSON result; numbers that are not finite become null."""
    write_text(path, json.dumps(_finite(content), indent=2, allow_nan=False) + "\n")


def _finite(value: Any) -> Any:
    if isinstance(value, dict):
        return {str(key): _finite(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [_finite(item) for item in value]
    if hasattr(value, "tolist"):
        return _finite(value.tolist())
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value


@app.command()
def simulate(
    model: Annotated[Path, typer.Argument(help="Model file of the machine.")],
    experiment: Annotated[Path, typer.Option("--experiment", help="Experiment file.")],
    out: Annotated[Path, typer.Option("--out", help="Bag to write.")],
    all_topics: Annotated[bool, typer.Option("--all-topics", help="Record the true output and command too.")] = False,
    elements: Elements = None,
) -> None:
    """Run an experiment without ROS: writes the bag that the graph would record."""
    from rhythmid.experiment import Experiment, perform
    from rhythmid.record.bag_writer import write_bag

    require_new(out)
    described = Experiment.load(experiment, tuple(elements or ()), model)
    messages = perform(described)
    wanted = list(messages) if all_topics else [topic for topic in described.record.topics if topic in messages]
    write_bag(
        out,
        {f"{described.namespace}/{topic}": messages[topic] for topic in wanted},
        storage=described.record.storage,
        run=described.description(),
        joint=described.joint,
        namespace=described.namespace,
    )
    typer.echo(f"{out}: {described.count} samples at {described.time.rate} Hz of {', '.join(wanted)}")


def main() -> None:
    """Entry point of the command: turns errors of the user's into one line and exit code 2."""
    for entry in entry_points(group=COMMAND_GROUP):
        entry.load()(app)
    try:
        code = app(standalone_mode=False)
    except InputError as error:
        _refuse(str(error))
    except (typer.Abort, KeyboardInterrupt):
        sys.exit(130)
    except Exception as error:
        describe = getattr(error, "format_message", None)  # bad usage, found by the parser
        if describe is None:
            raise
        _refuse(describe())
    else:
        sys.exit(code if isinstance(code, int) else 0)


def _refuse(problem: str) -> NoReturn:
    if problem:  # there is none when the command is called with nothing and shows its help
        console.print("[bold red]error:[/]", escape(" ".join(problem.split())), highlight=False, soft_wrap=True)
    sys.exit(2)


if __name__ == "__main__":
    main()
