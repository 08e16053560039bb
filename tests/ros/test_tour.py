"""The README's tour and its Python: every command as printed, in its order, in a copy of the folder that the tour begins in."""

import os
import re
import shutil
import subprocess
import sys
import textwrap
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
CONFIG = ROOT / "ros_ws" / "src" / "rhythmid_bringup" / "config"
BEGINNING = [". .venv/bin/activate", f"cd {CONFIG.relative_to(ROOT)}"]
PATIENCE = 300.0  # [s] for one command on a busy machine
WRITTEN = re.compile(r"--(?:out|output|json|save-model|report) (\S+)")
pytestmark = pytest.mark.timeout(1500)


def block(heading: str) -> str:
    """The first indented block of a section of the README."""
    readme = (ROOT / "README.md").read_text(encoding="utf-8")
    section = readme.partition(f"\n## {heading}\n")[2].partition("\n## ")[0]
    shown = re.search(r"(?:^    .*\n|^\n(?=    ))+", section, re.MULTILINE)
    assert shown is not None, heading
    return textwrap.dedent(shown[0]).strip()


def commands() -> list[str]:
    """Each command of the tour, as a shell takes it."""
    lines = block("A quick tour").replace("\\\n", " ").splitlines()
    assert lines[:2] == BEGINNING
    return [line for line in lines[2:] if line]


def in_shell(line: str, folder: Path) -> subprocess.CompletedProcess[str]:
    """A line as typed where the environment is active."""
    path = os.pathsep.join([str(Path(sys.executable).parent), os.environ["PATH"]])
    return subprocess.run(
        ["bash", "-c", line], cwd=folder, env=os.environ | {"PATH": path}, capture_output=True, text=True,
        timeout=PATIENCE, check=False,
    )  # fmt: skip


@pytest.fixture(scope="module")
def toured(tmp_path_factory) -> Path:
    """The folder after the tour; each command must have worked and written what it names."""
    folder = tmp_path_factory.mktemp("tour") / "config"
    shutil.copytree(CONFIG, folder, ignore=shutil.ignore_patterns("out"))  # the tour of a reader may be there
    for line in commands():
        done = in_shell(line, folder)
        assert done.returncode == 0, (line, done.stdout, done.stderr)
        for file in WRITTEN.findall(line):
            assert (folder / file).exists(), (line, file)
    return folder


def test_the_tour_shows_every_step_from_a_run_to_the_next_experiment():
    named = [line.split()[:2] for line in commands()]
    assert all(program == "rhythmid" for program, _ in named)
    shown = {command for _, command in named}
    assert shown >= {"run", "simulate", "check", "identify", "diagnose", "watch", "export", "design"}


def test_every_command_of_the_tour_works_as_printed(toured):
    assert (toured / "out" / "hop" / "metadata.yaml").is_file()
    page = (toured / "out" / "hop.html").read_text(encoding="utf-8")
    assert "<h1>Nothing is missing" in page  # the model is the machine
    assert '"separated_lines"' in (toured / "out" / "hop.json").read_text(encoding="utf-8")


def test_the_python_that_is_shown_runs_as_printed(toured):
    script = toured / "shown.py"
    script.write_text(block("From Python"), encoding="utf-8")
    done = in_shell("python shown.py", toured)
    assert done.returncode == 0, done.stderr
    assert "linear_spring.stiffness" in done.stdout
