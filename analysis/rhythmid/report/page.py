"""A report as one self-contained HTML page: nothing fetched, readable on a phone, in print, light and dark, and without scripts.

Its figures are drawings. A script, which the page allows by its hash, replaces them by plots that can be zoomed.
"""

import base64
import hashlib
import re
from dataclasses import dataclass
from html import escape
from importlib.resources import files
from pathlib import Path
from typing import Literal

from rhythmid import __version__
from rhythmid.output import write_text
from rhythmid.report.blocks import Section, Tiles, charts_of, joined, markup
from rhythmid.report.live import most_points

Tone = Literal["good", "found", "open", "plain"]
POLICY = "default-src 'none'; style-src 'unsafe-inline'; img-src data:"
STYLES = ("vendor/uplot/uPlot.min.css", "style.css")
DRAWN_BY = " Figures by uPlot, © Leon Sorokin, MIT licence."
HINT = (
    '<p class="hint screen">Figures: drag to zoom, double-click to show all, press a name in a legend to hide its curve; '
    "plots over the time of one record move together. "
    '<button type="button" class="drawings" aria-pressed="false" hidden>Drawings instead of plots</button></p>'
)
LIBRARY, LICENCE = "vendor/uplot/uPlot.iife.min.js", "vendor/uplot/LICENSE"
SCRIPTS = ("live_plot.js", "live.js")  # rhythmid's own scripts, in the order in which they run


@dataclass(frozen=True)
class Page:
    """A report.

    `kicker` says what kind of report of what, `verdict` is the answer in a few words, `words` the same in about two
    sentences, `tiles` its most important numbers. `tone` colours the verdict; the meaning never depends on the colour alone.
    """

    title: str
    kicker: str
    verdict: str
    words: str
    tone: Tone
    tiles: Tiles
    sections: tuple[Section, ...]


def render(page: Page) -> str:
    """The page as HTML text."""
    style = "\n".join(map(_file, STYLES))
    charts = charts_of([block for section in page.sections for block in section.blocks])
    most = most_points(charts)
    scripts = _scripts() if charts else []
    names = _anchors([section.title for section in page.sections])
    contents = "".join(
        f'<li><a href="#{name}">{escape(section.title)}</a></li>'
        for name, section in zip(names, page.sections)
    )
    body = "\n".join(
        f'<section id="{name}" aria-labelledby="{name}-title"><h2 id="{name}-title">{escape(section.title)}</h2>\n'
        f"{joined(section.blocks, most)}\n</section>"
        for name, section in zip(names, page.sections)
    )
    return f"""<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<meta http-equiv="Content-Security-Policy" content="{_policy(scripts)}">
<meta name="color-scheme" content="light dark">
<meta name="generator" content="rhythmid {escape(__version__)}">
<title>{escape(page.title)}</title>
<style>
{style}</style>
</head>
<body>
<a class="skip" href="#report">Skip to the report</a>
<header>
<p class="kicker">{escape(page.kicker)}</p>
<div class="verdict {page.tone}">
<h1>{escape(page.verdict)}</h1>
<p>{escape(page.words)}</p>
</div>
{markup(page.tiles) if page.tiles.items else ""}
</header>
<nav aria-label="Contents"><ol>{contents}</ol></nav>
{HINT if charts else ""}
<main id="report">
{body}
</main>
<footer><p>rhythmid {escape(__version__)}. Intervals are 95 % unless said otherwise.{DRAWN_BY if charts else ""}</p></footer>
{"".join(f"<script>{script}</script>" for script in scripts)}
</body>
</html>
"""


def _file(name: str) -> str:
    return files("rhythmid.report").joinpath(name).read_text(encoding="utf-8")


def _scripts() -> list[str]:
    """The library with its licence, which every copy has to contain, and rhythmid's own scripts."""
    return [f"/*\n{_file(LICENCE)}*/\n{_file(LIBRARY)}", *map(_file, SCRIPTS)]


def _policy(scripts: list[str]) -> str:
    """Content-Security-Policy of the page: it may run these scripts only, and fetch nothing."""
    hashes = [
        base64.b64encode(hashlib.sha256(script.encode("utf-8")).digest()).decode("ascii")
        for script in scripts
    ]
    allowed = " ".join(f"'sha256-{value}'" for value in hashes)
    return f"{POLICY}; script-src {allowed}" if allowed else POLICY


def write_page(path: Path, page: Page) -> None:
    """Write the page completely or not at all. Raises InputError if the place is not writable."""
    write_text(path, render(page))


def _anchors(titles: list[str]) -> list[str]:
    """Distinct names for links to sections."""
    taken: list[str] = []
    for title in titles:
        plain = re.sub(r"[^a-z0-9]+", "-", title.lower()).strip("-") or "section"
        name = plain
        for number in range(2, len(titles) + 2):
            if name not in taken:
                break
            name = f"{plain}-{number}"
        taken.append(name)
    return taken
