"""The tutorial up to the fit that misleads: its commands as printed give the figures that the page shows."""

import json
import re
import shlex
from pathlib import Path

import pytest

from rhythmid.cli import app

PAGE = (Path(__file__).parents[2] / "docs" / "tutorial.md").read_text(encoding="utf-8")
STEP = PAGE.partition("## 4. ")[2].partition("## 5. ")[0]


def test_the_fit_that_misleads_gives_the_figures_of_the_page(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for name, text in re.findall(r"```yaml\n# (\S+)\n(.*?)```", PAGE, re.DOTALL):
        Path(name).write_text(text, encoding="utf-8")
    commands = re.findall(r"^    rhythmid (simulate .*(?:small|large))$", PAGE, re.MULTILINE)
    (fit,) = re.findall(r"^    rhythmid (identify .*)$", STEP, re.MULTILINE)
    for line in (*commands, f"{fit} --quiet --json fit.json"):
        app(shlex.split(line), standalone_mode=False)
    found = json.loads(Path("fit.json").read_text(encoding="utf-8"))
    numbers = found["parameters"] | {f"delay: {name}": one for name, one in found["delays"].items()}
    rows = re.findall(r"^\| `([^`]+)` \| (\S+) \| (\S+) \|", STEP, re.MULTILINE)
    assert len(rows) == 5
    for name, value, std in rows:
        digit = 10.0 ** -len(value.partition(".")[2])  # of the last place that the page shows
        assert numbers[name]["value"] == pytest.approx(float(value), abs=digit), name
        assert numbers[name]["std"] == pytest.approx(float(std), abs=10.0 ** -len(std.partition(".")[2])), (
            name
        )
    (left,) = re.findall(r"it leaves ([\d.]+) % of the motion", STEP)
    assert 100.0 * found["quality"]["nrmse"] == pytest.approx(float(left), abs=0.1)
