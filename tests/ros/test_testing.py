"""`rhythmid.testing`: what the README and its page show runs as printed, and a node that fails makes the test fail with what it said."""

import os
import re
import shutil
import subprocess
import sys
from itertools import pairwise
from pathlib import Path

import pytest
from patience import LONG

from rhythmid.errors import InputError
from rhythmid_bringup.run import replacements

ROOT = Path(__file__).parents[2]
pytestmark = pytest.mark.timeout(LONG)


def run_tests(folder: Path, text: str, *options: str) -> subprocess.CompletedProcess[str]:
    """A test file run by a pytest of its own, beside the example's node."""
    (folder / "test_my_filter.py").write_text(text, encoding="utf-8")
    shutil.copy(ROOT / "docs" / "examples" / "command_filter.py", folder / "my_filter.py")
    words = [sys.executable, "-m", "pytest", "-p", "no:cacheprovider", "--rootdir", str(folder), *options]
    return subprocess.run(
        [*words, str(folder)], capture_output=True, text=True, cwd=folder, timeout=LONG, check=False,
        env={**os.environ, "ROS_DOMAIN_ID": "7"},  # which the run does not take over
    )  # fmt: skip


@pytest.mark.parametrize("document", ["README.md", "docs/testing.md"])
def test_the_example_runs_as_printed(tmp_path, document):
    page = (ROOT / document).read_text(encoding="utf-8")
    shown = re.search(r"```python\n(# test_my_filter.py\n.*?)```", page, re.DOTALL)
    assert shown is not None
    done = run_tests(tmp_path, shown[1])
    assert done.returncode == 0, done.stdout
    assert "1 passed" in done.stdout


def test_a_node_that_ends_fails_the_test_with_what_it_said(tmp_path):
    text = """
pytest_plugins = ["rhythmid.testing"]

def test_it(run_graph):
    chirp = {"type": "chirp", "amplitude": 0.05, "band": [1, 7], "sweep": 1.0}
    run_graph({"excitation": chirp}, replace={"measurement_delay": "python -c 'print(\\"no sensor\\"); exit(2)'"})
"""
    done = run_tests(tmp_path, text)
    assert done.returncode == 1
    assert "rhythmid run ended with exit code 1" in done.stdout
    assert "measurement_delay] no sensor" in done.stdout
    assert "measurement_delay ended with exit code 2" in done.stdout
    assert (
        "Traceback" not in done.stdout and "KeyboardInterrupt" not in done.stdout
    )  # of nodes that are ended
    assert "rhythmid/testing.py" not in done.stdout  # the failure is shown at the line of the test


def test_runs_side_by_side_do_not_hear_one_another(tmp_path):
    text = """
import time
import numpy as np
import pytest

pytest_plugins = ["rhythmid.testing"]

@pytest.mark.parametrize("amplitude", [0.01, 0.02])
def test_it(run_graph, request, amplitude):
    begin = time.monotonic()
    chirp = {"type": "chirp", "amplitude": amplitude, "band": [1, 7], "sweep": 1.0}
    run = run_graph({"excitation": chirp}, timeout=500.0)
    sent = run.values("excitation", "effort")
    assert len(sent) == 1000 and 0.9 * amplitude < np.abs(sent).max() <= amplitude
    np.testing.assert_array_equal(run.values("command", "effort"), sent)
    (request.path.parent / f"{amplitude}.span").write_text(f"{begin} {time.monotonic()}")
"""
    done = run_tests(tmp_path, text, "-n", "2")
    assert done.returncode == 0, done.stdout
    assert "2 workers" in done.stdout and "2 passed" in done.stdout
    spans = sorted(tuple(map(float, one.read_text().split())) for one in tmp_path.glob("*.span"))
    assert len(spans) == 2 and any(later < end for (_, end), (later, _) in pairwise(spans))  # they were


@pytest.mark.parametrize(
    ("given", "told"),
    [
        (["recorder=true"], "NAME one of plant, command_delay, measurement_delay"),
        (["plant"], "NAME=COMMAND is expected"),
        (["plant='"], "No closing quotation"),
        (["plant=no_such_program"], "no such command: no_such_program"),
        (["plant=true", "plant=false"], "plant is replaced twice"),
    ],
)
def test_a_replacement_that_cannot_be_is_refused_in_one_line(given, told):
    with pytest.raises(InputError, match=told) as refused:
        replacements(given)
    assert "\n" not in str(refused.value)


def test_a_node_alone_replaces_none(rhythmid, tmp_path):
    done = rhythmid("run", tmp_path / "absent.yaml", "--node", "plant", "--replace", "plant=true")
    assert done.returncode == 2
    assert done.stderr == "error: --node runs a node of ours, --replace one of yours: give one of the two\n"
