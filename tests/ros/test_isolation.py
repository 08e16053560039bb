"""Who can command the plant: nobody on another machine unless the user says so, and nobody at all from outside of an isolated run."""

import json
import os
import shutil
import signal
import subprocess
import sys
from pathlib import Path

import pytest
import yaml
from patience import LONG, PATIENCE

from rhythmid_bringup import isolation
from rhythmid_bringup.environment import run_environment

HERE = Path(__file__).parent
MODEL = HERE.parents[1] / "analysis" / "rhythmid" / "models" / "paper_hopper.yaml"
STRANGER = [sys.executable, str(HERE / "stranger.py")]
HIDDEN = "hidden"  # name and namespace of the isolated plant; no other test uses it, so whoever sees it has seen this one
PLANT = [
    sys.executable,
    "-m",
    "rhythmid_nodes.plant",
    "--ros-args",
    "-r",
    f"__ns:=/{HIDDEN}",
    "-r",
    f"__node:={HIDDEN}",
    "-p",
    f"model:={MODEL}",
]
pytestmark = pytest.mark.timeout(LONG)
REASON = isolation.why_not()
needs_namespaces = pytest.mark.skipif(REASON is not None, reason=f"no namespaces here: {REASON}")


def call(seconds: float, namespace: str = "hopper") -> dict:
    """What a stranger on this machine reaches in a namespace within some seconds."""
    done = subprocess.run([*STRANGER, str(seconds), namespace], capture_output=True, text=True, check=True)
    return json.loads(done.stdout)


@needs_namespaces
def test_a_stranger_in_the_same_domain_reaches_an_open_plant_but_no_isolated_one(domain, graph, monkeypatch):
    monkeypatch.delenv("RHYTHMID_SUPERVISOR")  # its child is a shell
    script = f"{' '.join(PLANT)} & {' '.join(STRANGER)} {PATIENCE:g} {HIDDEN}; wait"
    with subprocess.Popen(
        isolation.isolated(["sh", "-c", script]), stdout=subprocess.PIPE, text=True, start_new_session=True
    ) as inside:
        try:
            assert inside.stdout is not None
            insider = json.loads(inside.stdout.readline())
            assert insider["reached"] and insider["heard"], "the isolated plant does not work"
            outsider = call(5.0, HIDDEN)
            assert outsider == {"reached": 0, "heard": 0, "nodes": outsider["nodes"]}
            assert HIDDEN not in outsider["nodes"]
        finally:
            os.killpg(inside.pid, signal.SIGKILL)
    graph.spawn("plant", "plant", model=str(MODEL))
    openly = call(PATIENCE)
    assert openly["reached"] and openly["heard"]


@needs_namespaces
def test_an_isolated_run_leaves_its_bag(tmp_path, monkeypatch):
    monkeypatch.delenv("ROS_DOMAIN_ID", raising=False)
    (tmp_path / "short.yaml").write_text(
        yaml.safe_dump(
            {
                "model": str(MODEL),
                "excitation": {"type": "chirp", "amplitude": 0.05, "band": [1, 7], "sweep": 1.0},
                "time": {"mode": "lockstep", "layout": "composed"},
            }
        )
    )
    done = subprocess.run(
        [sys.executable, "-m", "rhythmid.cli", "run", "short.yaml", "--isolated", "--out", "bag"],
        cwd=tmp_path, capture_output=True, text=True, check=False, timeout=LONG,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "bag" / "metadata.yaml").is_file()


@pytest.mark.skipif(
    shutil.which("ip") is None or shutil.which("nsenter") is None, reason="iproute2 or nsenter is missing"
)
@needs_namespaces
@pytest.mark.parametrize(("chosen", "reached"), [("", False), ("SUBNET", True)])
def test_another_machine_is_heard_only_when_the_user_asks_for_it(tmp_path, chosen, reached):
    given = {name: value for name, value in os.environ.items() if not name.startswith("ROS_")}
    if chosen:
        given["ROS_AUTOMATIC_DISCOVERY_RANGE"] = chosen
    environment = run_environment(given, 77, tmp_path)
    del environment["RHYTHMID_SUPERVISOR"]  # its child is a shell
    user = [] if os.geteuid() == 0 else ["--user", "--map-root-user"]
    script = [
        "sh",
        str(HERE / "two_machines.sh"),
        environment["ROS_AUTOMATIC_DISCOVERY_RANGE"],
        sys.executable,
        str(MODEL),
    ]
    done = subprocess.run(
        ["unshare", *user, "--net", "--", *script, STRANGER[1], str(PATIENCE if reached else 6.0)],
        env=environment, capture_output=True, text=True, check=False, timeout=LONG,
    )  # fmt: skip
    if done.returncode == 3:
        pytest.skip("this kernel has no virtual cables (veth)")
    assert done.returncode == 0, done.stderr
    at_home, abroad = map(json.loads, done.stdout.splitlines())
    assert at_home["reached"] and at_home["heard"], done.stderr
    assert bool(abroad["reached"]) == bool(abroad["heard"]) == reached


def test_a_machine_without_the_program_is_told_in_one_line(monkeypatch):
    monkeypatch.setenv("PATH", "/nowhere")
    done = subprocess.run(
        [sys.executable, "-m", "rhythmid_bringup.isolation", "true"],
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 2 and done.stderr.count("\n") == 1
    assert "unshare (util-linux) is missing" in done.stderr
