"""The tutorial: its commands as printed give the figures that the page shows."""

import json
import re
import shlex
from pathlib import Path
from typing import Any

import pytest

from rhythmid.cli import app

PAGE = (Path(__file__).parents[2] / "docs" / "tutorial.md").read_text(encoding="utf-8")
ROW = re.compile(r"^\| `([^`]+)` \| (\S+) \| (\S+) \|", re.MULTILINE)


def step(number: int) -> str:
    """The text of a step of the page."""
    return PAGE.partition(f"## {number}. ")[2].partition("\n## ")[0]


def commands(number: int, name: str) -> list[str]:
    """The arguments of a step's commands of this name, as printed."""
    text = step(number).replace("\\\n", " ")
    return [
        line.partition("  #")[0] for line in re.findall(rf"^    rhythmid ({name} .*)$", text, re.MULTILINE)
    ]


def given(line: str) -> None:
    """Run a command as it is given on the page."""
    app(shlex.split(line), standalone_mode=False)


def answer_of(line: str, file: str) -> dict[str, Any]:
    """The JSON of a command."""
    given(f"{line} --quiet --json {file}")
    return json.loads(Path(file).read_text(encoding="utf-8"))


def last_place(shown: str) -> float:
    """The size of one in the last place of a number that the page shows."""
    return 10.0 ** -len(shown.partition(".")[2])


def compare(shown: str, numbers: dict[str, Any]) -> None:
    """The rows of a table on the page are these numbers, to the places that it shows."""
    for name, value, std in ROW.findall(shown):
        assert numbers[name]["value"] == pytest.approx(float(value), abs=last_place(value)), name
        assert numbers[name]["std"] == pytest.approx(float(std), abs=last_place(std)), name


@pytest.fixture
def recorded(tmp_path, monkeypatch) -> None:
    """The files of the page in an empty folder, and the recordings made from them."""
    monkeypatch.chdir(tmp_path)
    for name, text in re.findall(r"```yaml\n# (\S+)\n(.*?)```", PAGE, re.DOTALL):
        Path(name).write_text(text, encoding="utf-8")
    for line in commands(2, "simulate"):
        given(line)


def test_the_fit_that_misleads_gives_the_figures_of_the_page(recorded):
    (fit,) = commands(4, "identify")
    found = answer_of(fit, "fit.json")
    assert len(ROW.findall(step(4))) == 5
    compare(step(4), found["parameters"] | {f"delay: {name}": one for name, one in found["delays"].items()})
    (left,) = re.findall(r"it leaves ([\d.]+) % of the motion", step(4))
    assert 100.0 * found["quality"]["nrmse"] == pytest.approx(float(left), abs=0.1)


@pytest.mark.long
def test_the_diagnosis_and_the_better_model_give_the_figures_of_the_page(recorded):
    (line,) = commands(5, "diagnose")
    found = answer_of(line, "found.json")
    (effect,) = found["missing"]
    assert len(ROW.findall(step(5))) == 5
    compare(step(5), found["parameters"] | effect["parameters"])
    words = " ".join(step(5).split())
    assert found["summary"] in words
    assert f"probability {100.0 * effect['probability']:.1f} %" in words
    assert Path("page.html").stat().st_size > 0
    again, export = commands(6, "identify") + commands(6, "export")
    late = answer_of(again, "again.json")["delays"]["measurement"]
    value, std = re.findall(r"the measurement delay is gone: −([\d.]+) ± ([\d.]+) ms", step(6))[0]
    assert -1e3 * late["value"] == pytest.approx(float(value), abs=last_place(value))
    assert 1e3 * late["std"] == pytest.approx(float(std), abs=last_place(std))
    given(export)
    assert "frictionloss" in Path("joint.xml").read_text(encoding="utf-8")
