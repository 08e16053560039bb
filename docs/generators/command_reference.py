"""The reference of the command line, written from the commands themselves."""

from importlib.metadata import entry_points
from typing import Any

import typer

from rhythmid.cli import COMMAND_GROUP, app

HEAD = """# The command line

This page is generated from the commands; `rhythmid COMMAND --help` prints the same.

Exit code 0: an answer was reached, also when nothing is missing. 2: bad usage or bad input, with one line that says what. 1: a failure of
rhythmid. 130: interrupted. Nothing that exists is overwritten.
"""


def page() -> str:
    """Markdown with one section a command: summary, usage, arguments and options, examples."""
    for entry in entry_points(group=COMMAND_GROUP):
        entry.load()(app)
    commands: dict[str, Any] = typer.main.get_command(app).commands  # type: ignore[attr-defined]
    shown = {name: command for name, command in sorted(commands.items()) if not command.hidden}
    table = "\n".join(f"| [`{name}`](#rhythmid-{name}) | {_summary(one)} |" for name, one in shown.items())
    sections = "\n".join(_section(name, command) for name, command in shown.items())
    return f"{HEAD}\n| command | what it does |\n| --- | --- |\n{table}\n\n{sections}"


def _section(name: str, command: Any) -> str:
    arguments = [one for one in command.params if not one.opts[0].startswith("-")]
    options = [
        one for one in command.params if one.opts[0].startswith("-") and one.name != "help" and not one.hidden
    ]
    usage = " ".join(["rhythmid", name, *(["[OPTIONS]"] if options else []), *map(_placeholder, arguments)])
    parts = [f"## rhythmid {name}", _paragraphs(command.help), f"    {usage}"]
    if arguments:
        parts.append(_table("argument", [(f"`{_placeholder(one)}`", one) for one in arguments]))
    if options:
        parts.append(_table("option", [(_spelling(one), one) for one in options]))
    if examples := _examples(command.epilog):
        parts.append("\n".join(["Examples:", "", *(f"    {line}" for line in examples)]))
    return "\n\n".join(parts) + "\n"


def _summary(command: Any) -> str:
    return _cell((command.help or "").partition("\n\n")[0])


def _paragraphs(text: str | None) -> str:
    return "\n\n".join(" ".join(part.split()) for part in (text or "").split("\n\n"))


def _examples(epilog: str | None) -> list[str]:
    lines = [line.strip() for line in (epilog or "").splitlines()]
    return [line for line in lines if line.startswith("rhythmid ")]


def _placeholder(argument: Any) -> str:
    name = (argument.metavar or argument.name).upper()
    name = f"{name}..." if argument.nargs == -1 else name
    return name if argument.required else f"[{name}]"


def _spelling(option: Any) -> str:
    value = "" if option.is_flag else " " + (option.metavar or option.name.upper())
    return ", ".join(f"`{one}{value}`" for one in (*option.opts, *option.secondary_opts))


def _table(kind: str, rows: list[tuple[str, Any]]) -> str:
    cells = [[spelling, _cell(one.help or ""), _default(one)] for spelling, one in rows]
    width = 3 if any(default for *_, default in cells) else 2
    table = [[kind, "meaning", "default"], ["---"] * 3, *cells]
    return "\n".join(f"| {' | '.join(row[:width])} |" for row in table)


def _default(one: Any) -> str:
    if one.required:
        return "required"
    return "" if one.default in (None, False, (), []) or callable(one.default) else f"`{one.default}`"


def _cell(text: str) -> str:
    return " ".join(text.split()).replace("|", r"\|")
