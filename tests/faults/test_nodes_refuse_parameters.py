"""Node processes refuse wrong parameters with one line that names parameter, value and range, and exit code 2."""

import os
import subprocess
import sys
from pathlib import Path

import pytest
from patience import PATIENCE

pytest.importorskip("rclpy")

from rhythmid_bringup.environment import own_domain, run_environment

FOLDER = Path(__file__).parents[2] / "ros_ws" / "src" / "rhythmid_bringup" / "config"


@pytest.fixture(autouse=True)
def domain(tmp_path, monkeypatch):
    """A DDS domain of their own: in everybody's, the middleware of other processes may make theirs say more."""
    monkeypatch.delenv("ROS_DOMAIN_ID", raising=False)
    with own_domain() as number:
        for name, value in run_environment(os.environ, number, tmp_path / "log").items():
            monkeypatch.setenv(name, value)
        yield


def run_node(executable, *arguments):
    return subprocess.run(
        [sys.executable, "-m", f"rhythmid_nodes.{executable}", "--ros-args", *arguments],
        capture_output=True, text=True, timeout=PATIENCE, check=False, cwd=FOLDER,
    )  # fmt: skip


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["-p", "delay"], "Couldn't parse parameter override rule: '-p delay'"),
        (["--params-file", "missing.yaml"], "Couldn't parse params file: '--params-file missing.yaml'"),
        (["--delay", "0.04"], "--delay"),
    ],
)
def test_ros_arguments_that_cannot_be_parsed_are_refused_likewise(arguments, said):
    done = run_node("delay_injector", *arguments)
    last = done.stderr.splitlines()[-1]  # rcl may have logged a line of its own before
    assert done.returncode == 2 and last.startswith("error: ") and said in last
    assert "Traceback" not in done.stderr


@pytest.mark.parametrize(
    ("executable", "given", "said"),
    [
        ("delay_injector", "delay:=-0.04", "error: parameter delay = -0.04 must lie in [0, 10] s"),
        ("delay_injector", "delay:=.nan", "error: parameter delay = nan must lie in [0, 10] s"),
        (
            "delay_injector",
            "delai:=0.04",
            "error: unknown parameter delai; did you mean delay?",
        ),
        (
            "delay_injector",
            "stamp_mode:=late",
            "error: parameter stamp_mode = 'late' must be one of arrival, keep",
        ),
        ("excitation", "excitation:=chirp", "error: parameter excitation is not JSON"),
        ("recorder", "topics:=excitation", "error: parameter topics = 'excitation' must be a list"),
        ("plant", "model:=missing.yaml", "error: missing.yaml"),
    ],
)
def test_a_wrong_parameter_is_refused_with_one_line_and_code_2(executable, given, said):
    done = run_node(executable, "-p", given)
    assert done.returncode == 2
    assert done.stderr.startswith(said) and len(done.stderr.splitlines()) == 1
