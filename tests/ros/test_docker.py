"""The containers: a container for each node, the analysis apart from the experiment; really built where that is possible."""

import importlib.util
import json
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
import yaml

from rhythmid.experiment import Experiment

ROOT = Path(__file__).parents[2]
DEMO = ROOT / "ros_ws/src/rhythmid_bringup/config/demo.yaml"
STORAGE = ROOT / "out" / "docker"


@pytest.fixture(scope="module")
def builder():
    spec = importlib.util.spec_from_file_location("without_engine", ROOT / "docker" / "without_engine.py")
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture(scope="module")
def services(builder):
    content = yaml.safe_load((ROOT / "docker" / "compose.yaml").read_text(encoding="utf-8"))
    return builder.substituted(content["services"])


def test_every_node_of_the_graph_is_a_container_of_its_own(services):
    nodes = {spec.name for spec in Experiment.load(DEMO).nodes()}
    assert set(services) == nodes | {"analysis"}
    for name in nodes:
        assert services[name]["command"][-2:] == ["--node", name] or f"--node {name}" in " ".join(
            services[name]["command"]
        )
        assert services[name]["network_mode"] == services[name]["ipc"] == "host"


def test_the_analysis_sees_the_bag_and_nothing_of_the_experiment(services):
    assert services["analysis"]["volumes"] == ["bags:/data"]
    assert not any("experiment" in word for word in services["analysis"]["command"])
    with_bags = {name for name, service in services.items() if "bags:/data" in service["volumes"]}
    assert with_bags == {"recorder", "analysis"}


@pytest.mark.parametrize("name", ["Dockerfile", "Dockerfile.jazzy"])
def test_dockerfiles_copy_what_exists_and_do_not_run_as_root(name):
    text = (ROOT / "docker" / name).read_text(encoding="utf-8")
    ignored = (ROOT / ".dockerignore").read_text(encoding="utf-8").split()
    for line in re.findall(r"^COPY (.*)$", text, re.MULTILINE):
        for source in line.split()[:-1]:
            assert (ROOT / source).exists(), source
            assert any(f"!{part}" in ignored for part in (source, *map(str, Path(source).parents))), source
    users = re.findall(r"^USER (.*)$", text, re.MULTILINE)
    assert users and users[-1] != "root"


def _why_not() -> str:
    """What is missing for a real build; empty when nothing is."""
    if shutil.which("buildah") is None:
        return "buildah is not installed"
    if os.geteuid() != 0:
        return "chroot isolation needs root"
    if not (STORAGE / "store").is_dir():
        return "there is no base image: make docker makes one"
    return ""


@pytest.mark.timeout(900)
@pytest.mark.skipif(bool(_why_not()), reason=_why_not() or "can be built")
def test_the_graph_runs_in_containers_and_is_identified_from_the_bag_that_they_leave(tmp_path):
    tmp_path.chmod(0o755)  # the containers' user reads the experiment
    shutil.copy(DEMO.parent / "paper_hopper.yaml", tmp_path)
    (tmp_path / "short.yaml").write_text(
        "model: paper_hopper.yaml\nexcitation: {type: chirp, amplitude: 0.004, sweep: 10, repetitions: 9, warm_up: 1, "
        "shift: {period: 1, count: 9}}\ndelays: {input: 0.04, measurement: 0.05}\n"
        "time: {mode: lockstep, layout: processes}\n",
        encoding="utf-8",
    )
    done = subprocess.run(
        [sys.executable, ROOT / "docker" / "without_engine.py", "--folder", STORAGE],
        capture_output=True, text=True, timeout=840, check=False,
        env={**os.environ, "EXPERIMENT": str(tmp_path), "FILE": "short.yaml", "ROS_DOMAIN_ID": "87"},
    )  # fmt: skip
    assert done.returncode == 0, done.stdout + done.stderr
    bag = Path(done.stdout.rsplit("bag: ", 1)[1].strip())
    assert (bag / "metadata.yaml").is_file()
    delays = json.loads((bag.parent / "result.json").read_text(encoding="utf-8"))["delays"]
    assert delays["input"]["value"] == pytest.approx(0.04, abs=1e-3)
    assert delays["measurement"]["value"] == pytest.approx(0.05, abs=1e-3)
    shutil.rmtree(bag.parents[1])
