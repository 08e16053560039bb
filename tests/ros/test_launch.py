"""The launch file says the same nodes as the experiment; ROS's launch itself is not available from PyPI: a substitute."""

import importlib.util
import sys
import types
import xml.etree.ElementTree as ElementTree
from pathlib import Path

import pytest

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
        "launch_ros.actions": ("Node",),
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
    nodes = [node.keywords for node in launch_file.graph(context)]
    specs = experiment.nodes()
    assert [node["name"] for node in nodes] == [spec.name for spec in specs]
    for node, spec in zip(nodes, specs, strict=True):
        assert (node["package"], node["executable"]) == (spec.package, spec.executable)
        assert node["namespace"] == "/hopper" and dict(node["remappings"]) == dict(spec.remappings)
        unattended = {"unattended": True} if spec.executable == "excitation" else {}
        assert node["parameters"] == [{**given_parameters(spec), **unattended}]


@pytest.mark.parametrize(("returncode", "expected"), [(0, None), (1, 1), (2, 2), (-9, 137)])
def test_any_nodes_end_shuts_it_down_with_that_nodes_exit_code(
    launch_file, monkeypatch, tmp_path, returncode, expected
):
    exits = []
    monkeypatch.setattr(launch_file.atexit, "register", lambda _exit, code: exits.append(code))
    context = {"experiment": str(BRINGUP / "config" / "demo.yaml"), "bag": str(tmp_path / "bag")}
    assert all(node.keywords["on_exit"] is launch_file.shut_down for node in launch_file.graph(context))
    event = types.SimpleNamespace(returncode=returncode, process_name="plant-1")
    (action,) = launch_file.shut_down(event, types.SimpleNamespace(is_shutdown=False))
    assert type(action).__name__ == "Shutdown" and "plant-1" in action.keywords["reason"]
    assert launch_file.shut_down(event, types.SimpleNamespace(is_shutdown=True)) == []
    assert exits == ([] if expected is None else [expected])


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
