"""The README's quick tour: every command as printed, in its order, in a copy of the folder that the tour begins in."""

import re
import shlex
import shutil
from pathlib import Path

import pytest
import yaml

ROOT = Path(__file__).parents[2]
SHORTER = {  # the tour's own runs last a minute in real time; these give the same files
    "demo.yaml": {"repetitions": 4, "shift": {"period": 1.0, "count": 4}},
    "lockstep.yaml": {"repetitions": 1, "shift": {"period": 1.0, "count": 1}},
}
RATE = 250  # Hz
ELSEWHERE = {"table1"}  # takes minutes: tests/unit/test_table1.py


def tour() -> list[list[str]]:
    """The arguments of each command of the tour."""
    readme = (ROOT / "README.md").read_text(encoding="utf-8")
    shown = re.search(r"^## A quick tour\n\n((?:(?:    .*)?\n)+)", readme, re.MULTILINE)
    assert shown is not None
    lines = [shlex.split(line, comments=True) for line in shown[1].replace("\\\n", " ").splitlines()]
    entered, commands = lines[:2], [line for line in lines[2:] if line]
    assert entered == [[".", ".venv/bin/activate"], ["cd", "ros_ws/src/rhythmid_bringup/config"]]
    assert all(words[0] == "rhythmid" for words in commands)
    return [words[1:] for words in commands]


@pytest.mark.timeout(600)
def test_every_command_of_the_tour_works_as_printed(rhythmid, tmp_path):
    folder = tmp_path / "config"
    shutil.copytree(ROOT / "ros_ws" / "src" / "rhythmid_bringup" / "config", folder)
    for name, excitation in SHORTER.items():
        experiment = yaml.safe_load((folder / name).read_text(encoding="utf-8"))
        experiment["excitation"] |= excitation
        experiment["time"] = {"mode": "lockstep", "rate": RATE, "layout": "composed"}
        (folder / name).write_text(yaml.safe_dump(experiment), encoding="utf-8")
    commands = tour()
    assert {words[0] for words in commands} >= {"run", "check", "identify", "diagnose", "watch", "design"}
    for words in commands:
        if words[0] in ELSEWHERE:
            continue
        done = rhythmid(*words, cwd=folder, timeout=250.0)
        assert done.returncode == 0, (words, done.stdout, done.stderr)
        for option, file in zip(words, words[1:]):
            assert (
                option not in ("--out", "--output", "--json", "--save-model") or (folder / file).exists()
            ), words
