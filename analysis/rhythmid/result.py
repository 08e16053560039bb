"""What all results share: text as on the terminal, tables for pandas, and a small table in a notebook."""

import html
import io
from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from importlib import import_module
from typing import TYPE_CHECKING, Any

from rhythmid.errors import InputError

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes
    from rich.console import Console

Row = Mapping[str, Any]
WIDTH = 80  # default number of characters of a line
ESTIMATE = ("value", "std", "unit")  # columns that are shown together: value ± half of the 95 % interval


class Result(ABC):
    """A result that can be read: `summary`, `to_dict`, `to_dataframe`, and as a table in a notebook."""

    @property
    @abstractmethod
    def headline(self) -> str:
        """The answer in one sentence."""

    @abstractmethod
    def show(self, console: "Console") -> None:
        """Print the result as the command `rhythmid` does."""

    @abstractmethod
    def to_dict(self) -> dict[str, Any]:
        """The result as plain JSON data: numbers, lists, strings, None."""

    @abstractmethod
    def tables(self) -> Mapping[str, Sequence[Row]]:
        """The result's tables by name, the main one first; the rows of a table have the same keys."""

    def summary(self, width: int = WIDTH) -> str:
        """The result as text, as the command `rhythmid` prints it.

        Parameters
        ----------
        width
            Characters of a line; tables fit 40 and more.
        """
        from rich.console import Console

        text = io.StringIO()
        self.show(Console(file=text, width=width, color_system=None))
        return text.getvalue()

    def to_dataframe(self, table: str | None = None) -> "pd.DataFrame":
        """One of the `tables` as a pandas DataFrame.

        Parameters
        ----------
        table
            Name of the table; None for the main one.

        Raises
        ------
        InputError
            If there is no such table, or pandas is not installed.
        """
        known = self.tables()
        name = next(iter(known)) if table is None else table
        if name not in known:
            raise InputError(f"there is no table {name!r}; one of {', '.join(known)} is expected")
        return optional("pandas", "to_dataframe").DataFrame([dict(row) for row in known[name]])

    def _repr_html_(self) -> str:
        """Headline and main table, all of it as text that cannot become markup."""
        name, rows = next(iter(self.tables().items()))
        return f"<p><b>{html.escape(self.headline)}</b></p>\n{_html_table(name, rows)}"


def _html_table(name: str, rows: Sequence[Row]) -> str:
    from rhythmid.report.quantity import estimate, number

    if not rows:
        return ""
    joined = all(key in rows[0] for key in ESTIMATE)
    heads = [key for key in rows[0] if not (joined and key in ESTIMATE[1:])]

    def cell(row: Row, key: str) -> str:
        if joined and key == "value":
            return html.escape(estimate(row["value"], row["std"], row["unit"]))
        value = row[key]
        return html.escape(
            number(value) if isinstance(value, float) else "—" if value is None else str(value)
        )

    head = "".join(f"<th>{html.escape(key.replace('_', ' '))}</th>" for key in heads)
    body = "\n".join(f"<tr>{''.join(f'<td>{cell(row, key)}</td>' for key in heads)}</tr>" for row in rows)
    return f"<table>\n<caption>{html.escape(name)}</caption>\n<tr>{head}</tr>\n{body}\n</table>"


def optional(package: str, method: str) -> Any:
    """A package that only some methods need. Raises InputError, saying what to install, where it is missing."""
    try:
        return import_module(package)
    except ModuleNotFoundError as missing:
        if missing.name != package:
            raise
        raise InputError(
            f"{method} needs {package}; install it with: pip install 'rhythmid[notebook]'"
        ) from None


def legend_above(axis: "Axes") -> None:
    """The legend in a line above the axis, so that it hides no curve."""
    axis.legend(
        loc="lower left",
        bbox_to_anchor=(0.0, 1.0),
        ncols=3,
        frameon=False,
        borderaxespad=0.2,
        fontsize="small",
    )


def axis_or_new(axis: "Axes | None") -> "Axes":
    """The axis, or one of a new pyplot figure."""
    if axis is not None:
        return axis
    from matplotlib import pyplot

    return pyplot.subplots(layout="constrained")[1]
