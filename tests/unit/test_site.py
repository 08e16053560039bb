"""The documentation site: it builds without a warning, its links hold, and what its pages show works."""

import os
import re
import subprocess
import sys
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote, urlsplit

import pytest
import yaml

import rhythmid
from rhythmid.elements.catalogue import load_catalogue
from rhythmid.model import Model
from rhythmid.offline_run import simulate
from rhythmid.proof.rate import Rate
from rhythmid.record.signals import Signals

ROOT = Path(__file__).parents[2]
DOCS = ROOT / "docs"


class Page(HTMLParser):
    """What a page refers to, and the places in it that can be referred to."""

    def __init__(self, path: Path) -> None:
        super().__init__()
        self.targets: list[str] = []
        self.places: set[str] = set()
        self.feed(path.read_text(encoding="utf-8"))

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        for name, value in attrs:
            if name in ("href", "src") and value:
                self.targets.append(value)
            elif name == "id" and value:
                self.places.add(value)


@pytest.fixture(scope="module")
def site(tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("site")
    built = subprocess.run(
        [sys.executable, "-m", "mkdocs", "build", "--strict", "--site-dir", folder],
        cwd=ROOT, env=os.environ | {"NO_MKDOCS_2_WARNING": "1"}, capture_output=True, text=True, timeout=600,
    )  # fmt: skip
    assert built.returncode == 0, built.stderr
    assert "WARNING" not in built.stderr
    return folder


@pytest.fixture(scope="module")
def pages(site) -> dict[Path, Page]:
    return {path: Page(path) for path in site.rglob("*.html") if path.name != "404.html"}


def block(page: str, name: str) -> str:
    found = re.search(rf"```\w+\n(# {re.escape(name)}\n.*?)```", (DOCS / page).read_text("utf-8"), re.DOTALL)
    assert found is not None, name
    return found[1]


def test_every_link_within_the_site_leads_to_a_page_and_a_place_that_exist(site, pages):
    for path, page in pages.items():
        for target in page.targets:
            parts = urlsplit(target)
            if parts.scheme or parts.netloc:
                continue
            led = (path.parent / unquote(parts.path)).resolve() if parts.path else path
            assert led.exists(), f"{path.name}: {target}"
            if parts.fragment and led in pages:
                assert unquote(parts.fragment) in pages[led].places, f"{path.name}: {target}"


def test_a_page_loads_nothing_from_elsewhere(pages):
    for path in pages:
        loaded = re.findall(
            r"<(?:script|img|link)\b[^>]*?(?:src|href)=\"(https?:[^\"]*)", path.read_text("utf-8")
        )
        assert loaded == [], path.name


def test_every_page_is_reached_from_the_navigation(site):
    config = re.sub(r"!!python\S*", "", (ROOT / "mkdocs.yml").read_text(encoding="utf-8"))
    named = set(re.findall(r"[\w]+\.md", str(yaml.safe_load(config)["nav"])))
    assert {path.name for path in DOCS.glob("*.md")} <= named


def test_the_reference_has_every_command(pages, site):
    places = pages[site / "cli.html"].places
    for command in ("check", "diagnose", "identify", "run", "simulate", "watch"):
        assert f"rhythmid-{command}" in places


def test_the_reference_of_the_python_interface_has_every_public_name(pages, site):
    places = {place.rpartition(".")[2] for place in pages[site / "api.html"].places}
    assert set(rhythmid.__all__) - {"__version__"} <= places


def test_the_files_of_the_tutorial_make_the_recordings_of_the_tutorial(tmp_path):
    for name in ("robot", "model", "small", "large", "unseen"):
        (tmp_path / f"{name}.yaml").write_text(block("tutorial.md", f"{name}.yaml"), encoding="utf-8")
    believed = Model.load(tmp_path / "model.yaml")
    assert "coulomb_friction.force" in Model.load(tmp_path / "robot.yaml").parameters
    assert set(believed.free) == {"input_delay.delay", "linear_spring.stiffness", "viscous_damper.damping"}
    for name in ("small", "large", "unseen"):
        assert simulate(None, tmp_path / f"{name}.yaml").record.duration > 19.0


def test_the_element_that_is_shown_can_be_loaded_and_simulated(tmp_path):
    folder = tmp_path / "my_elements"
    folder.mkdir()
    (folder / "cubic_drag.py").write_text(
        block("own_element.md", "my_elements/cubic_drag.py"), encoding="utf-8"
    )
    catalogue = load_catalogue([folder])
    assert catalogue["cubic_drag"].size == "coefficient"
    text = block("tutorial.md", "model.yaml") + "  - cubic_drag: {coefficient: 0.5}\n"
    assert Model.from_text(text, catalogue=catalogue).value("cubic_drag.coefficient") == 0.5


def test_the_signals_and_parameters_that_are_shown_are_read(tmp_path):
    signals = Signals.from_text(block("bag.md", "signals.yaml"), tmp_path / "signals.yaml")
    assert signals.use == (5.0, 120.0)
    nodes = yaml.safe_load(block("robot.md", "robot.yaml"))
    assert set(nodes) == {"/**/excitation", "/**/command_guard", "/**/recorder"}


def test_the_citation_is_of_this_version():
    assert (
        yaml.safe_load((ROOT / "CITATION.cff").read_text(encoding="utf-8"))["version"] == rhythmid.__version__
    )


def test_the_figures_of_the_summary_are_those_of_the_pages_that_it_sums_up():
    summary = (DOCS / "validation.md").read_text(encoding="utf-8")
    real = (DOCS / "real.md").read_text(encoding="utf-8")
    for before, after in re.findall(r"([\d.]+) → ([\d.]+) %", summary):
        assert f"| {before} → {after} |" in real, before


ROW = re.compile(
    r"^\| ([^|]+) \| ([^|]+) \| [^|]* \| (\d+) of (\d+) \| (\d+) of (\d+) = ([\d.]+) % \(([\d.]+)–([\d.]+)\) \|$",
    re.MULTILINE,
)


def test_the_latest_campaigns_are_part_of_all_and_the_rates_have_wilsons_intervals():
    rows = ROW.findall((DOCS / "proof.md").read_text(encoding="utf-8"))
    assert len(rows) > 10
    for kind, quantity, *counts in rows:
        now, of_now, every, of_every = map(int, counts[:4])
        assert now <= every and 0 <= of_now - now <= of_every - every, (kind, quantity)
        stated = [float(one) for one in counts[4:]]
        expected = [100.0 * one for one in (every / of_every, *Rate(every, of_every).interval)]
        assert stated == pytest.approx(expected, abs=0.051), (kind, quantity)


def counted(page: str, kind: str, quantity: str) -> tuple[int, int]:
    """How many, of how many cases, all versions together."""
    found = [row for row in ROW.findall(page) if row[0] == kind and row[1].startswith(quantity)]
    assert len(found) == 1, (kind, quantity)
    return int(found[0][4]), int(found[0][5])


def test_the_rates_on_the_first_page_and_in_the_texts_are_those_of_the_campaigns():
    proof = (DOCS / "proof.md").read_text(encoding="utf-8")
    first, cases = counted(proof, "One effect, cluttered", "concealed effect first")
    wrong, _ = counted(proof, "One effect, cluttered", "a wrong name")
    clean, of_clean = counted(proof, "Nothing missing, clean", "something named")
    untidy, of_untidy = counted(proof, "Nothing missing, cluttered", "something named")
    relative, of_relative = counted(proof, "Law not in the catalogue, cluttered", "a wrong name")
    summary = (DOCS / "validation.md").read_text(encoding="utf-8")
    readme = (ROOT / "README.md").read_text(encoding="utf-8")
    package = (ROOT / "analysis" / "README.md").read_text(encoding="utf-8")
    for page in (readme, summary, package):
        assert f"first in {first} of {cases} cases" in page
        assert f"in {clean} of {of_clean} clean cases" in page
    assert f"of 0.8 or more in {wrong} of {cases}" in readme
    assert f"a wrong name in {wrong} of {cases}" in summary
    assert f"in {untidy} of {of_untidy} untidy ones" in readme and f"in {untidy} of {of_untidy}" in summary
    for kind, quantity in (
        ("One effect, cluttered", "95 % intervals of the effect"),
        ("One effect, cluttered", "95 % intervals of machine"),
        ("Nothing missing, clean", "95 % intervals of machine"),
        ("Nothing missing, cluttered", "95 % intervals of machine"),
        ("Two effects, cluttered", "both exact"),
        ("Two effects, cluttered", "95 % intervals"),
        ("Law not in the catalogue, cluttered", "a wrong name"),
    ):
        held, of_held = counted(proof, kind, quantity)
        assert f"in {held} of {of_held}" in summary, (kind, quantity)
    missing = (DOCS / "missing_physics.md").read_text(encoding="utf-8")
    evidence = (DOCS / "evidence.md").read_text(encoding="utf-8")
    for page in (readme, summary, package, missing, evidence):
        assert re.search(rf"\b{relative} of\s{of_relative}\b", page)


def test_the_real_recordings_on_the_first_page_are_those_of_the_summary():
    summary = (DOCS / "validation.md").read_text(encoding="utf-8")
    pairs = re.findall(
        r"^\| (?:recordings of|simulated machines).*right in (\d+) of (\d+)", summary, re.MULTILINE
    )
    right, cases = (sum(map(int, column)) for column in zip(*pairs))
    assert f"right in {right} of {cases}" in (ROOT / "README.md").read_text(encoding="utf-8")


def test_the_table_of_kinds_of_machines_counts_the_recordings_that_are_listed():
    listed = (DOCS / "recordings.md").read_text(encoding="utf-8")
    real = (DOCS / "real.md").read_text(encoding="utf-8")
    for section in re.split(r"^## ", listed, flags=re.MULTILINE)[1:]:
        kind = section.partition("\n")[0]
        results = re.findall(r"^\| .* \| ([^|]+) \|$", section, re.MULTILINE)
        stated = [
            word.strip("* ") for one in results for word in one.partition(";")[0].split(", ")
        ]  # a row of several machines has a result for each
        right, known = stated.count("right"), stated.count("listed")
        wrong = stated.count("missed") + stated.count("wrong")
        if kind != "Robots with several joints":
            row = f"| {right + known + wrong} | {right} | {known} | {wrong} |"
            assert re.search(rf"^\| \[{re.escape(kind)}\].*{re.escape(row)}$", real, re.MULTILINE), kind
