"""Terminal display of a running machine: the values of its twin, and the punctuality of signals and nodes, in at least 40 columns."""

from __future__ import annotations

from collections.abc import Mapping

from diagnostic_msgs.msg import DiagnosticStatus
from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

from rhythmid_nodes.diagnostics import PREFIX
from rhythmid_nodes.twin import UNSTAMPED

MODEL = "/model"  # suffix of the status that a twin reports of the machine
RATE, LOST = " rate [Hz]", " lost"  # suffixes of the keys of a signal's figures
LATE_P99, LATE_MAX = " lateness p99 [ms]", " lateness max [ms]"
STAGES = (
    "lateness",
    "delay_error",
    "transport",
)  # lateness figures of a node, of which the worst is shown
LATE_COUNTS = ("late", "late_commands")
_COLOURS = {DiagnosticStatus.OK: "green", DiagnosticStatus.WARN: "yellow", DiagnosticStatus.ERROR: "bold red"}


def drawn(newest: Mapping[str, DiagnosticStatus]) -> RenderableType:
    """The display: the models first, then rate and lateness of the signals that a twin receives, then those of all nodes."""
    if not newest:
        return Text("waiting for the twin")
    figures = {
        name.removeprefix(PREFIX): {pair.key: pair.value for pair in status.values}
        for name, status in newest.items()
    }
    parts: list[RenderableType] = []
    signals, nodes = (
        _table("signal", "Hz", "p99 ms", "max ms", "lost"),
        _table("node", "Hz", "p99 ms", "max ms", "late"),
    )
    for name, status in sorted(newest.items()):
        short = name.removeprefix(PREFIX)
        if name.endswith(MODEL):
            parts += _model(short, status)
        else:
            _add_signals(signals, figures[short])
            _add_node(nodes, short, status, figures[short])
    return Group(*parts, *(table for table in (signals, nodes) if table.row_count))


def _model(name: str, status: DiagnosticStatus) -> list[RenderableType]:
    """The status of a twin: its sentence, and its values."""
    table = Table(box=None, show_header=False, padding=(0, 1), pad_edge=False)
    table.add_column(overflow="fold")
    table.add_column(justify="right", overflow="fold")
    for pair in status.values:
        table.add_row(Text(pair.key), Text(pair.value))
    headline = Text.assemble((f"{name}  ", "bold"), (status.message, _COLOURS.get(status.level, "dim")))
    return [headline, table, Text("")]


def _table(*titles: str) -> Table:
    """A table of names and numbers."""
    table = Table(box=None, padding=(0, 1), pad_edge=False, header_style="bold")
    for number, title in enumerate(titles):
        table.add_column(title, justify="right" if number else "left", overflow="fold")
    return table


def _add_signals(table: Table, figures: Mapping[str, str]) -> None:
    """A row for each signal whose rate and lateness a node reports."""
    for key, rate in figures.items():
        if key.endswith(RATE):
            topic = key.removesuffix(RATE)
            unknown = "no stamps" if f"{topic} {UNSTAMPED}" in figures else ""
            late = (figures.get(topic + end, unknown) for end in (LATE_P99, LATE_MAX))
            table.add_row(topic, rate, *map(_short, late), figures.get(topic + LOST, ""))


def _add_node(table: Table, name: str, status: DiagnosticStatus, figures: Mapping[str, str]) -> None:
    """A node's row: the worst lateness of its stages, and how many messages were late."""

    def worst(what: str) -> str:
        known = [float(figures[key]) for stage in STAGES if (key := f"{stage}_{what}_ms") in figures]
        return _short(str(max(known))) if known else ""

    late = next((figures[key] for key in LATE_COUNTS if key in figures), "")
    colour = _COLOURS.get(status.level, "dim")
    rate = _short(figures.get("rate_hz", ""))
    table.add_row(Text(name, colour), rate, worst("p99"), worst("max"), late)
    if status.level != DiagnosticStatus.OK:
        table.add_row(Text(f"  {status.message}", colour))


def _short(value: str) -> str:
    """A number with few enough digits for a narrow terminal; other text is unchanged."""
    try:
        number = float(value)
    except ValueError:
        return value
    return f"{number:.3g}" if abs(number) < 1000.0 else f"{number:.0f}"
