"""Pages: self-contained, safe, complete, whatever the diagnosis found."""

import base64
import hashlib
import json
import re
from dataclasses import replace
from html.parser import HTMLParser
from importlib.resources import files
from pathlib import Path

import numpy as np
import pytest
from reported import REMAINDER, by_effort, estimate, findings, identified, result

from rhythmid.errors import InputError
from rhythmid.report.diagnosis import diagnosis_page
from rhythmid.report.identification import comparison_section, identification_page
from rhythmid.report.page import Page, render, write_page

EVIL = '</title><img src=x onerror="alert(1)">'


class Outline(HTMLParser):
    """Headings, links, ids, figures and their captions, addresses."""

    VOID = {"meta", "link", "br", "img", "hr", "input"}

    def __init__(self, text: str) -> None:
        super().__init__()
        self.tags: list[tuple[str, dict[str, str | None]]] = []
        self.open: list[str] = []
        self.feed(text)
        self.close()

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append((tag, dict(attrs)))
        if tag not in self.VOID:
            self.open.append(tag)

    def handle_startendtag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append((tag, dict(attrs)))

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag

    def all(self, tag: str) -> list[dict[str, str | None]]:
        return [attributes for name, attributes in self.tags if name == tag]


def pages() -> list[tuple[str, Page]]:
    made = [
        (verdict, diagnosis_page(findings(result(verdict))))
        for verdict in ("consistent", "missing_physics", "undecided")
    ]
    unknown = result("unknown_physics") | {"remainder": REMAINDER}
    made.append(("unknown_physics", diagnosis_page(findings(unknown))))
    made.append(("effort", diagnosis_page(by_effort())))
    made.append(("unforced", diagnosis_page(findings(result(), forced=False))))
    made.append(
        (
            "identification",
            identification_page(identified(), "hopper.yaml from run", (), "rhythmid identify run", {}),
        )
    )
    return made


@pytest.fixture(scope="module", params=pages(), ids=lambda case: case[0])
def html(request: pytest.FixtureRequest) -> str:
    return render(request.param[1])


def test_tags_are_balanced_and_headings_in_order(html: str) -> None:
    outline = Outline(html)
    assert outline.open == []
    levels = [int(tag[1]) for tag, _ in outline.tags if re.fullmatch("h[1-6]", tag)]
    assert levels.count(1) == 1 and levels[0] == 1
    assert all(after - before <= 1 for before, after in zip(levels, levels[1:]))


SCRIPT = re.compile(r"<script>(.*?)</script>", re.DOTALL)


def test_nothing_is_fetched_and_only_the_packages_own_scripts_run(html: str) -> None:
    outline, plain = Outline(html), SCRIPT.sub("", html)
    assert not outline.all("link") and not outline.all("iframe")
    assert not re.search(r"https?://", plain.replace("http://www.w3.org/2000/svg", ""))
    assert "url(" not in html and "@import" not in html
    assert {one.get("type") for one in outline.all("script")} <= {None, "application/json"}
    assert not [name for _, given in outline.tags for name in given if name.startswith("on")]
    policy = str(
        next(m for m in outline.all("meta") if m.get("http-equiv") == "Content-Security-Policy")["content"]
    )
    assert "default-src 'none'" in policy and "unsafe-eval" not in policy
    allowed = re.search("script-src (.*)", policy)[1].split()
    own = [base64.b64encode(hashlib.sha256(text.encode()).digest()).decode() for text in SCRIPT.findall(html)]
    assert allowed == [f"'sha256-{value}'" for value in own] and len(own) == 3


def test_every_figure_over_an_axis_brings_its_data_along(html: str) -> None:
    charts = [json.loads(text) for text in re.findall('<script type="application/json">(.*?)</script>', html)]
    assert charts and all(chart["curves"] and chart["alt"] for chart in charts)
    assert all(chart["x"]["range"][0] < chart["x"]["range"][1] for chart in charts)
    assert 'aria-hidden="true"' in html and "<noscript" not in html  # the drawings are there without scripts


def test_the_page_names_the_library_that_draws_its_figures(html: str) -> None:
    folder = files("rhythmid.report") / "vendor" / "uplot"
    assert "uPlot, © Leon Sorokin, MIT" in html
    assert (folder / "LICENSE").read_text(encoding="utf-8") in html  # every copy has to bear it
    version = re.search(r"uPlot \((v[\d.]+)\)", (folder / "uPlot.iife.min.js").read_text(encoding="utf-8"))[1]
    assert f"uPlot {version[1:]}" in (folder / "README.md").read_text(encoding="utf-8")


def test_every_figure_says_what_to_see_in_it(html: str) -> None:
    captions = re.findall(r"<figcaption>(.*?)</figcaption>", html, re.DOTALL)
    assert len(captions) == html.count("<figure") > 3
    assert all(len(caption) > 30 for caption in captions)
    for attributes in Outline(html).all("svg"):
        assert attributes.get("aria-hidden") == "true" or attributes.get("aria-label")


def test_links_lead_to_sections_with_distinct_names(html: str) -> None:
    outline = Outline(html)
    names = [a["id"] for _, a in outline.tags if "id" in a]
    assert len(names) == len(set(names))
    links = [str(a["href"]) for a in outline.all("a")]
    assert links and all(link.startswith("#") and link[1:] in names for link in links)


def test_names_from_recordings_stay_text() -> None:
    told = result()
    told["next_experiment"] = told["excluded"][0]["name"] = EVIL
    html = SCRIPT.sub("", render(diagnosis_page(findings(told, name=EVIL))))
    assert "<img" not in html
    assert "&lt;img" in html and "\\u003cimg" in html  # as text, and as data


@pytest.mark.parametrize(
    ("verdict", "heading"),
    [
        ("consistent", "Nothing is missing"),
        ("missing_physics", "Missing physics: Coulomb friction"),
        ("unknown_physics", "Something unknown is missing"),
        ("undecided", "Undecided"),
    ],
)
def test_the_verdict_comes_first(verdict: str, heading: str) -> None:
    html = render(diagnosis_page(findings(result(verdict))))
    assert f"<h1>{heading}</h1>" in html
    assert html.index("<h1>") < html.index("<nav") < html.index("<section")


def test_an_identification_without_separable_delays_gives_the_sum_only() -> None:
    told = identified()
    nothing = estimate(0.0, None, "s") | {"value": None}
    told["delays"] |= {
        "separable": False,
        "input": nothing,
        "measurement": nothing,
        "assumption": "no forcing is known",
    }
    told["delays"] |= {
        "intervals": {"input": [0.0, 0.035]},
        "undetermined": ["both delays by opposite amounts"],
    }
    html = render(identification_page(told, "a model from run", (), "rhythmid identify run", {}))
    assert "Use only the sum of the two delays" in html
    assert "late together" in html
    assert "between 0.00\u202fms and 35.00\u202fms" in html
    assert "both delays by opposite amounts" in html


def test_experiments_stand_beside_their_actual_delays() -> None:
    experiment = identified() | {"actual": {"input": 0.02, "measurement": 0.016}}
    section = comparison_section([experiment, experiment], ["1", "2"])
    html = render(
        Page("t", "k", "v", "w", "plain", identification_page(experiment, "", (), "", {}).tiles, (section,))
    )
    assert "20.0 / 16.0 ms" in html and "21.0 / 14.1 ms" in html
    assert "largest error of the final estimates is 1.00\u202fms" in html


def test_a_page_of_many_long_records_stays_below_two_megabytes() -> None:
    made, count = findings(result()), 20_000
    time, everything = np.arange(count) * 1e-3, np.ones(count, bool)
    noise = 1e-4 * np.random.default_rng(0).standard_normal((3, count))
    motion = 0.01 * np.cos(4.0 * np.pi * time)
    run = replace(
        made.runs[0], time=time, measured=motion + noise[0], before=motion + noise[1], after=motion + noise[2],
        position=motion, velocity=np.gradient(motion, 1e-3), phase=time % 1.0, used=everything, hidden=~everything,
    )  # fmt: skip
    page = diagnosis_page(replace(made, runs=tuple(replace(run, name=f"run {i}") for i in range(14))))
    assert 1_000_000 < len(render(page).encode("utf-8")) < 2_000_000


def test_a_page_is_written_whole_or_not_at_all(tmp_path: Path) -> None:
    page = diagnosis_page(findings(result()))
    write_page(tmp_path / "report.html", page)
    assert (tmp_path / "report.html").read_text(encoding="utf-8").endswith("</html>\n")
    with pytest.raises(InputError):
        write_page(tmp_path / "report.html" / "below a file.html", page)
    assert [path.name for path in tmp_path.iterdir()] == ["report.html"]
