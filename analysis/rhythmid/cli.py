"""The command `rhythmid`. Exit codes: 0 an answer was reached, 2 bad usage or bad input, 1 an internal error."""

import errno
import importlib
import pkgutil
import shutil
import sys
from importlib.metadata import entry_points
from typing import Annotated, NoReturn

import typer

from rhythmid import __version__, commands
from rhythmid.commands.begin import BEGIN
from rhythmid.commands.examples import epilog
from rhythmid.errors import InputError
from rhythmid.ros_packages import not_installed

NAME = "rhythmid"
NARROW = 80  # in fewer columns, framed help would cut off the options' names
app = typer.Typer(
    name=NAME,
    help="Find out why a simulation disagrees with a robot: name the physics that a model lacks, and identify parameters and delays, from recordings.",
    epilog=epilog(["rhythmid diagnose bag --model model.yaml", "rhythmid COMMAND --help"]),
    invoke_without_command=True,
    context_settings={"help_option_names": ["-h", "--help"]},
    pretty_exceptions_enable=False,
    rich_markup_mode="rich" if shutil.get_terminal_size().columns >= NARROW else None,
)
COMMAND_GROUP = "rhythmid.commands"
RUN = "run"  # added by the package rhythmid_bringup
UNUSABLE_PATHS = (errno.ENAMETOOLONG, errno.EACCES)  # of a path that the user gave, whoever looks at it first
SEVERAL = ("--holdout", "--elements")  # options that may be followed by several values
PARTS = (
    "begin",
    "examples",
    "joint_design",
    "machines",
    "model_line",
    "narrow_help",
    "options",
    "terminal",
)  # modules of `commands` that are not commands


def _version(show: bool) -> None:
    if show:
        typer.echo(f"rhythmid {__version__}")
        raise typer.Exit


@app.callback()
def _main(
    context: typer.Context,
    version: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="Print the version.")
    ] = False,
) -> None:
    if context.invoked_subcommand is None:
        typer.echo(BEGIN, nl=False)


HELP_WIDTH, HELP_MARGIN = 50, 2  # columns that click's help takes at least, and leaves free on the right

for _module in pkgutil.iter_modules(commands.__path__):
    if _module.name not in PARTS:
        _name = _module.name
        _code = importlib.import_module(f"rhythmid.commands.{_name}")
        app.command(name=_name, epilog=epilog(_code.EXAMPLES))(getattr(_code, _name))


def main() -> None:
    """Entry point of the command: turns errors of the user's into one line and exit code 2."""
    entries = entry_points(group=COMMAND_GROUP)
    for entry in entries:
        entry.load()(app)
    if RUN not in {entry.name for entry in entries}:
        app.command(name=RUN, context_settings={"ignore_unknown_options": True})(_run)
    narrow = _narrow()
    if narrow is not None:
        from rhythmid.commands.narrow_help import use_narrow_help

        use_narrow_help()
    try:
        code = app(spread(sys.argv[1:]), prog_name=NAME, standalone_mode=False, terminal_width=narrow)
    except InputError as error:
        _refuse(str(error))
    except (typer.Abort, KeyboardInterrupt):
        sys.exit(130)
    except OSError as error:
        if error.errno not in UNUSABLE_PATHS or error.filename is None:
            raise
        _refuse(str(InputError(f"{error.filename}: {error.strerror}")))
    except Exception as error:
        describe = getattr(error, "format_message", None)  # bad usage, detected by the parser
        if describe is None:
            raise
        _refuse(describe())
    else:
        sys.exit(code if isinstance(code, int) else 0)


def _narrow() -> int | None:
    """Columns of a terminal in which the help would not fit: click writes at least 50 unless it is told. None for a wider one."""
    columns = shutil.get_terminal_size().columns
    return max(columns - HELP_MARGIN, 1) if columns < HELP_WIDTH + HELP_MARGIN else None


def _run(arguments: Annotated[list[str] | None, typer.Argument(metavar="EXPERIMENT")] = None) -> None:
    """Run the ROS graph of an experiment. Its packages are not installed here."""
    raise not_installed("rhythmid run", "rhythmid_bringup")


def spread(arguments: list[str]) -> list[str]:
    """Arguments in which an option with several values, such as `--holdout a b`, is repeated for each value."""
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
    from rich.console import Console
    from rich.markup import escape

    console = Console(stderr=True)
    console.print("[bold red]error:[/]", escape(" ".join(problem.split())), highlight=False, soft_wrap=True)
    sys.exit(2)


if __name__ == "__main__":
    main()
