"""Parts of a section of a page, and their HTML. Blocks hold plain text, so that no name from a recording can become markup."""

import re
from collections.abc import Sequence
from dataclasses import dataclass, field
from html import escape
from typing import Union
from urllib.parse import quote

from rhythmid.report.chart import Chart, draw
from rhythmid.report.live import FEWEST_POINTS, chart_data


@dataclass(frozen=True)
class Paragraph:
    """Plain words; `kind` is "" or "lead", "note" or "aside"."""

    text: str
    kind: str = ""


@dataclass(frozen=True)
class Bullets:
    items: tuple[str, ...]


@dataclass(frozen=True)
class Tile:
    """One summary figure: its name, its value, a remark."""

    label: str
    value: str
    note: str = ""


@dataclass(frozen=True)
class Tiles:
    items: tuple[Tile, ...]


@dataclass(frozen=True)
class Equation:
    text: str


@dataclass(frozen=True)
class Table:
    """Rows of text under `columns`. `marked` are rows that stand out, `formulas` columns whose texts hold symbols
    with indices. The first column names the row, and leads to the address in `links` where there is one.

    On a narrow screen each row becomes a card.
    """

    caption: str
    columns: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    marked: tuple[int, ...] = ()
    formulas: tuple[int, ...] = ()
    links: tuple[str, ...] = ()


@dataclass(frozen=True)
class Drawing:
    """An SVG drawing made by this package, with what to see in it.

    `legend` are (style, label) pairs; a style that begins with "square " or "circle " is shown as a mark, others as a line.
    If there is a `chart`, the page's script draws it in place of the drawing.
    """

    title: str
    svg: str
    caption: str
    legend: tuple[tuple[str, str], ...] = ()
    wide: bool = False
    chart: Chart | None = None


@dataclass(frozen=True)
class Code:
    """Text to be copied unchanged."""

    label: str
    text: str


@dataclass(frozen=True)
class Columns:
    """Blocks side by side if there is room."""

    blocks: tuple["Block", ...]


@dataclass(frozen=True)
class Fold:
    """Blocks that are shown on demand, and always in print."""

    summary: str
    blocks: tuple["Block", ...]
    open: bool = False


@dataclass(frozen=True)
class Heading:
    text: str


Block = Union[Paragraph, Bullets, Tiles, Equation, Table, Drawing, Code, Columns, Fold, Heading]  # noqa: UP007


@dataclass(frozen=True)
class Section:
    """A part of the page under a heading; `title` is also its place in the list of contents."""

    title: str
    blocks: tuple[Block, ...] = field(default=())


def drawing(title: str, chart: Chart, caption: str, wide: bool = False) -> Drawing:
    """A chart as a block."""
    return Drawing(title, draw(chart), caption, chart.legend, wide, chart)


def charts_of(blocks: Sequence[Block]) -> list[Chart]:
    """All charts among the blocks, in order."""
    found: list[Chart] = []
    for block in blocks:
        match block:
            case Drawing(chart=Chart() as chart):
                found.append(chart)
            case Columns(inner) | Fold(_, inner):
                found += charts_of(inner)
    return found


def markup(block: Block, most: int = FEWEST_POINTS) -> str:
    """HTML of one block; curves of its charts have `most` points at most."""
    match block:
        case Paragraph(text, kind):
            return f'<p class="{kind}">{words(text)}</p>' if kind else f"<p>{words(text)}</p>"
        case Bullets(items):
            return "<ul>" + "".join(f"<li>{words(item)}</li>" for item in items) + "</ul>"
        case Tiles(items):
            return '<dl class="tiles">' + "".join(map(_tile, items)) + "</dl>"
        case Equation(text):
            return f'<p class="equation">{formula(text)}</p>'
        case Table():
            return _table(block)
        case Drawing():
            return _figure(block, most)
        case Code(label, text):
            return f'<p class="code-label">{escape(label)}</p><pre tabindex="0"><code>{escape(text)}</code></pre>'
        case Columns(blocks):
            return f'<div class="columns">{joined(blocks, most)}</div>'
        case Fold(summary, blocks, opened):
            state = " open" if opened else ""
            return f"<details{state}><summary>{escape(summary)}</summary>{joined(blocks, most)}</details>"
        case Heading(text):
            return f"<h3>{escape(text)}</h3>"


def words(text: str) -> str:
    """Escaped text, with the indices of delays as subscripts."""
    return re.sub(r"([τδ])_([uyf])\b", r"\1<sub>\2</sub>", escape(text))


def formula(text: str) -> str:
    """An equation with its indices (_c, _{k−1}) as subscripts and exponents (^{…}) as superscripts."""
    safe = re.sub(r"_\{([^{}]*)\}|_(\w+±?)", lambda m: f"<sub>{m[1] or m[2]}</sub>", escape(text))
    return re.sub(r"\^\{([^{}]*)\}", r"<sup>\1</sup>", safe)


def joined(blocks: Sequence[Block], most: int = FEWEST_POINTS) -> str:
    """HTML of blocks, one after another."""
    return "\n".join(markup(block, most) for block in blocks)


def _tile(tile: Tile) -> str:
    note = f'<dd class="note">{escape(tile.note)}</dd>' if tile.note else ""
    return f'<div><dt>{escape(tile.label)}</dt><dd class="value">{escape(tile.value)}</dd>{note}</div>'


def _table(table: Table) -> str:
    # the roles keep it a table for screen readers if the style sheet shows rows as cards
    head = "".join(f'<th role="columnheader" scope="col">{escape(name)}</th>' for name in table.columns)
    rows = []
    for index, row in enumerate(table.rows):
        mark = ' class="marked"' if index in table.marked else ""
        named = words(row[0])
        if index < len(table.links) and table.links[index]:
            named = f'<a href="{escape(quote(table.links[index]), quote=True)}">{named}</a>'
        cells = [f'<th role="rowheader" scope="row">{named}</th>']
        cells += [
            f'<td role="cell" data-label="{escape(name, quote=True)}"><span>{formula(text) if i in table.formulas else words(text)}</span></td>'
            for i, (name, text) in enumerate(zip(table.columns[1:], row[1:]), start=1)
        ]
        rows.append(f'<tr role="row"{mark}>{"".join(cells)}</tr>')
    return (
        f'<table role="table"><caption>{escape(table.caption)}</caption>'
        f'<thead role="rowgroup"><tr role="row">{head}</tr></thead>'
        f'<tbody role="rowgroup">{"".join(rows)}</tbody></table>'
    )


def _swatch(style: str) -> str:
    if style.startswith("square "):
        return f'<rect class="dot {style[7:]}" x="7" y="1" width="8" height="8"/>'
    if style.startswith("circle "):
        return f'<circle class="dot {style[7:]}" cx="11" cy="5" r="4.5"/>'
    return f'<path class="line {style}" d="M1 5H21"/>'


def _figure(figure: Drawing, most: int) -> str:
    legend = "".join(
        f'<li><svg viewBox="0 0 22 10" aria-hidden="true">{_swatch(style)}</svg>{escape(label)}</li>'
        for style, label in figure.legend
    )
    listed = f'<ul class="legend">{legend}</ul>' if legend else ""
    wide = ' class="wide"' if figure.wide else ""
    data = ""
    if figure.chart is not None and figure.chart.curves:
        data = f'<script type="application/json">{chart_data(figure.chart, most)}</script>'
    return (
        f'<figure{wide}><p class="figure-title">{escape(figure.title)}</p>{listed}{figure.svg}'
        f"<figcaption>{words(figure.caption)}</figcaption>{data}</figure>"
    )
