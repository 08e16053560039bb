"""Delays from real-time bags, recorded while the machine has other work, against what the injectors logged."""

import json
import os
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
import yaml
from patience import LONG, UNHURRIED

MODEL = Path(__file__).parents[2] / "analysis" / "rhythmid" / "models" / "paper_hopper.yaml"
DELAYS = {"input": 0.040, "measurement": 0.050}
CLOSE = 0.3  # ms
SURE = 3.0  # standard deviations, which a machine that starves the graph makes large
SWEEP = 12.0  # s
pytestmark = pytest.mark.timeout(LONG)


@contextmanager
def other_work() -> Iterator[None]:
    """A process for every processor that never rests."""
    busy = [
        subprocess.Popen([sys.executable, "-S", "-c", "while True: pass"]) for _ in os.sched_getaffinity(0)
    ]
    try:
        yield
    finally:
        for process in busy:
            process.kill()
            process.wait()


def figures(summary: str) -> dict[str, dict[str, str]]:
    """Node -> its figures, as the summary of a run prints them: the node's name stands before its first one, and figures that are zero
    stand together at its end."""
    found: dict[str, dict[str, str]] = {}
    node, zero = "", False
    for line in summary.splitlines():
        words = line.split()
        if words and words[0] in ("plant", "command_delay", "measurement_delay", "excitation", "recorder"):
            node, words, zero = words[0], words[1:], False
        zero = zero or words[:1] == ["none"]
        if node and zero and line.startswith((node, " ")):
            found.setdefault(node, {}).update(dict.fromkeys(" ".join(words).replace(",", " ").split(), "0"))
            continue
        if (
            node
            and len(words) == 2
            and line.startswith(("plant", "command", "measurement", "excitation", " "))
        ):
            found.setdefault(node, {})[words[0]] = words[1]
    return found


@pytest.fixture
def recorded(rhythmid, tmp_path) -> tuple[Path, dict[str, dict[str, str]]]:
    """A bag of what a user of the robot sees, and what the nodes said of themselves."""
    experiment = {
        "model": str(MODEL),
        "excitation": {"type": "chirp", "amplitude": 0.1, "band": [0, 7], "sweep": SWEEP},
        "delays": DELAYS,
        "time": {"mode": "realtime", "layout": "processes"},
        "safety": {
            "stale_after": UNHURRIED
        },  # the busy machine's stalls are to be recorded, not to end the run
        "record": {"topics": ["excitation", "joint_states", "forcing", "run"]},
    }
    (tmp_path / "experiment.yaml").write_text(yaml.safe_dump(experiment))
    with other_work():
        done = rhythmid("run", "experiment.yaml", "--out", "bag")
    assert done.returncode == 0, done.stderr
    return tmp_path / "bag", figures(done.stderr)


def test_delays_of_a_busy_machine_lie_between_what_was_asked_for_and_the_mean_of_what_was_applied(
    recorded, rhythmid, tmp_path
):
    bag, told = recorded
    done = rhythmid("identify", bag, "--json", "result.json")
    assert done.returncode == 0, done.stderr
    result = json.loads((tmp_path / "result.json").read_text())
    nothing = {"value": 0.0, "std": 0.0}
    drift = {
        "input": result["parameters"].get("input_delay_drift.rate", nothing),
        "measurement": result["parameters"].get("clock_skew.skew", nothing),
    }
    for name, node in (("input", "command_delay"), ("measurement", "measurement_delay")):
        applied = float(told[node]["applied_delay_mean_ms"])
        if name == "input":
            applied += float(told["plant"]["transport_mean_ms"])
        assert told[node]["dropped"] == "0"
        assert applied >= 1e3 * DELAYS[name]  # nothing is released early
        found, std = (  # in the middle of the run
            1e3 * (result["delays"][name][key] + 0.5 * SWEEP * drift[name][key]) for key in ("value", "std")
        )
        close = CLOSE + SURE * std
        # a stall of the whole machine holds a few messages back for long: the mean moves, most messages do not
        assert 1e3 * DELAYS[name] - close < found < applied + close, (name, std, told)
    for name, true, share in (
        ("linear_spring.stiffness", 200.0, 2e-3),
        ("switched_damper.stance", 2.0, 2e-2),
    ):
        estimate = result["parameters"][name]
        assert abs(estimate["value"] - true) < share * true + SURE * estimate["std"], (name, estimate)
