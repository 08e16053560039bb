"""The launch file says the same nodes as the experiment, with a substitute for ROS's launch, which PyPI does not have; and where
launch is installed, what really comes of it."""

import importlib.util
import os
import re
import signal
import subprocess
import sys
import time
import types
import xml.etree.ElementTree as ElementTree
from pathlib import Path

import pytest
from lifecycle_msgs.msg import Transition
from patience import LONG, PATIENCE
from short_run import content, experiment_file

from rhythmid.errors import InputError
from rhythmid.experiment import Experiment
from rhythmid_bringup.arguments import given_parameters

BRINGUP = Path(__file__).parents[2] / "ros_ws" / "src" / "rhythmid_bringup"


class Action:
    """Remembers what it was made of."""

    def __init__(self, *arguments, **keywords):
        self.arguments, self.keywords = arguments, keywords


class Configuration(Action):
    def perform(self, context):
        return context[self.arguments[0]]


@pytest.fixture
def launch_file(monkeypatch):
    """The launch file as a module, with substitutes for `launch` and `launch_ros`."""
    names = {
        "launch": ("LaunchContext", "LaunchDescription"),
        "launch.actions": ("DeclareLaunchArgument", "OpaqueFunction", "Shutdown"),
        "launch.events": (),
        "launch.events.process": ("ProcessExited",),
        "launch.substitutions": (),
        "launch_ros": (),
        "launch_ros.actions": ("LifecycleNode", "LifecycleTransition", "Node"),
    }
    for module, classes in names.items():
        made = types.ModuleType(module)
        for name in classes:
            setattr(made, name, type(name, (Action,), {}))
        monkeypatch.setitem(sys.modules, module, made)
    substitutions = sys.modules["launch.substitutions"]
    monkeypatch.setattr(substitutions, "LaunchConfiguration", Configuration, raising=False)
    spec = importlib.util.spec_from_file_location(
        "experiment_launch", BRINGUP / "launch" / "experiment.launch.py"
    )
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.mark.parametrize("name", ["demo.yaml", "lockstep.yaml"])
def test_it_starts_the_experiments_nodes_with_their_parameters(launch_file, tmp_path, name):
    experiment = Experiment.load(BRINGUP / "config" / name).with_record(path=tmp_path / "bag")
    context = {"experiment": str(BRINGUP / "config" / name), "bag": str(tmp_path / "bag")}
    nodes = [made.keywords for made in launch_file.graph(context) if type(made).__name__ == "LifecycleNode"]
    specs = experiment.nodes()
    assert [node["name"] for node in nodes] == [spec.name for spec in specs]
    for node, spec in zip(nodes, specs, strict=True):
        assert (node["package"], node["executable"]) == (spec.package, spec.executable)
        assert node["namespace"] == "/hopper" and dict(node["remappings"]) == dict(spec.remappings)
        unattended = {"unattended": True, "autostart": False} if spec.executable == "excitation" else {}
        assert node["parameters"] == [{**given_parameters(spec), **unattended}]


def test_it_configures_and_activates_the_excitation(launch_file, tmp_path):
    context = {"experiment": str(BRINGUP / "config" / "demo.yaml"), "bag": str(tmp_path / "bag")}
    (made,) = [made for made in launch_file.graph(context) if type(made).__name__ == "LifecycleTransition"]
    assert made.keywords["lifecycle_node_names"] == ["/hopper/excitation"]
    assert made.keywords["transition_ids"] == [
        Transition.TRANSITION_CONFIGURE,
        Transition.TRANSITION_ACTIVATE,
    ]


@pytest.mark.parametrize(("returncode", "expected"), [(0, None), (1, 1), (2, 2), (-9, 137)])
def test_any_nodes_end_shuts_it_down_with_that_nodes_exit_code(
    launch_file, monkeypatch, tmp_path, returncode, expected
):
    exits = []
    monkeypatch.setattr(launch_file.atexit, "register", lambda _exit, code: exits.append(code))
    context = {"experiment": str(BRINGUP / "config" / "demo.yaml"), "bag": str(tmp_path / "bag")}
    nodes = [made for made in launch_file.graph(context) if type(made).__name__ == "LifecycleNode"]
    assert nodes and all(node.keywords["on_exit"] is launch_file.shut_down for node in nodes)
    event = types.SimpleNamespace(returncode=returncode, process_name="plant-1")
    (action,) = launch_file.shut_down(event, types.SimpleNamespace(is_shutdown=False))
    assert type(action).__name__ == "Shutdown" and "plant-1" in action.keywords["reason"]
    assert launch_file.shut_down(event, types.SimpleNamespace(is_shutdown=True)) == []
    assert exits == ([] if expected is None else [expected])


LAUNCH = """
import sys
from launch import LaunchDescription, LaunchService
from launch.actions import IncludeLaunchDescription
from launch.launch_description_sources import PythonLaunchDescriptionSource
source = PythonLaunchDescriptionSource(sys.argv[1])
arguments = [tuple(word.split(":=", 1)) for word in sys.argv[2:]]
service = LaunchService()
service.include_launch_description(LaunchDescription([IncludeLaunchDescription(source, launch_arguments=arguments)]))
sys.exit(service.run())
"""


def prefix(folder: Path) -> Path:
    """A prefix with the executables of the nodes, as an installation of the package has them."""
    marker = folder / "share" / "ament_index" / "resource_index" / "packages" / "rhythmid_nodes"
    marker.parent.mkdir(parents=True)
    marker.touch()
    scripts = folder / "lib" / "rhythmid_nodes"
    scripts.mkdir(parents=True)
    for name in ("plant", "excitation", "delay_injector", "recorder"):
        (scripts / name).write_text(f'#!/bin/sh\nexec {sys.executable} -m rhythmid_nodes.{name} "$@"\n')
        (scripts / name).chmod(0o755)
    return folder


@pytest.mark.timeout(LONG)
@pytest.mark.skipif(importlib.util.find_spec("launch_ros") is None, reason="ROS's launch is not installed")
def test_a_killed_plant_ends_a_real_launch_at_once_with_its_exit_code_and_a_valid_bag(
    domain, no_shared_memory, tmp_path, monkeypatch
):
    monkeypatch.delenv("RHYTHMID_SUPERVISOR", raising=False)
    path = experiment_file(tmp_path, time={"mode": "realtime", "layout": "processes"}, duration=60.0)
    words = [f"experiment:={path}", f"bag:={tmp_path / 'bag'}"]
    prefixes = os.pathsep.join(
        filter(None, [str(prefix(tmp_path / "ros")), os.environ.get("AMENT_PREFIX_PATH")])
    )
    with (tmp_path / "said").open("w+") as said:
        launched = subprocess.Popen(
            [sys.executable, "-c", LAUNCH, str(BRINGUP / "launch" / "experiment.launch.py"), *words],
            stdout=said, stderr=said, env={**os.environ, "AMENT_PREFIX_PATH": prefixes},
        )  # fmt: skip
        patience = time.monotonic() + 2 * PATIENCE
        while "excitation starts" not in (text := (tmp_path / "said").read_text()):
            assert launched.poll() is None and time.monotonic() < patience, text
            time.sleep(0.1)
        started = re.search(r"\[plant-\d+\]: process started with pid \[(\d+)\]", text)
        assert started is not None
        time.sleep(2.0)  # two chunks of the bag
        os.kill(int(started[1]), signal.SIGKILL)
        assert launched.wait(PATIENCE) == 128 + signal.SIGKILL
    rows, _ = content(tmp_path / "bag")
    assert rows["excitation"] and len(rows["joint_states"]) > 50


def test_its_arguments_are_declared(launch_file):
    actions = launch_file.generate_launch_description().arguments[0]
    assert [action.arguments[0] for action in actions[:-1]] == ["experiment", "bag"]
    assert actions[-1].keywords["function"] is launch_file.graph


def test_an_existing_bag_is_refused(launch_file, tmp_path):
    context = {"experiment": str(BRINGUP / "config" / "lockstep.yaml"), "bag": str(tmp_path)}
    with pytest.raises(InputError, match="exists already"):
        launch_file.graph(context)


def test_the_shipped_model_is_the_papers():
    model = BRINGUP.parents[2] / "analysis" / "rhythmid" / "models" / "paper_hopper.yaml"
    assert (BRINGUP / "config" / "paper_hopper.yaml").read_text() == model.read_text()


def test_the_plotjuggler_layout_names_topics_that_exist():
    topics = {"/hopper/excitation", "/hopper/forcing", "/hopper/joint_states", "/hopper/plant/joint_states"}
    layout = ElementTree.parse(BRINGUP / "layouts" / "hopper.xml")
    for curve in layout.iter("curve"):
        for key in ("curve_x", "curve_y") if "curve_x" in curve.attrib else ("name",):
            assert curve.attrib[key].rpartition("/leg/")[0] in topics
