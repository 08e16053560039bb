"""The command `rhythmid`. Exit codes: 0 an answer was reached, 2 bad usage or bad input, 1 a failure of ours."""

import importlib
import pkgutil
import sys
from importlib.metadata import entry_points
from typing import Annotated, NoReturn

import typer
from rich.console import Console
from rich.markup import escape

from rhythmid import __version__, commands
from rhythmid.errors import InputError

app = typer.Typer(
    name="rhythmid",
    help="Identify rhythmic robots from their recordings, and name the physics that a model lacks.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
)
COMMAND_GROUP = "rhythmid.commands"
SEVERAL = ("--holdout", "--elements")  # options that may be followed by several values
console = Console(stderr=True)


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


for _module in pkgutil.iter_modules(commands.__path__):
    if _module.name not in ("options", "machines"):
        _name = _module.name
        app.command(name=_name)(getattr(importlib.import_module(f"rhythmid.commands.{_name}"), _name))


def main() -> None:
    """Entry point of the command: turns errors of the user's into one line and exit code 2."""
    for entry in entry_points(group=COMMAND_GROUP):
        entry.load()(app)
    try:
        code = app(spread(sys.argv[1:]), standalone_mode=False)
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


def spread(arguments: list[str]) -> list[str]:
    """Arguments in which several values after one `--holdout` or `--elements` stand one by one behind their option."""
    found: list[str] = []
    option, taken = "", 0
    for argument in arguments:
        if argument.startswith("-"):
            option, taken = (argument, 0) if argument in SEVERAL else ("", 0)
        elif option:
            if taken:
                found.append(option)
            taken += 1
        found.append(argument)
    return found


def _refuse(problem: str) -> NoReturn:
    if problem:  # there is none when the command is called with nothing and shows its help
        console.print(
            "[bold red]error:[/]", escape(" ".join(problem.split())), highlight=False, soft_wrap=True
        )
    sys.exit(2)


if __name__ == "__main__":
    main()
