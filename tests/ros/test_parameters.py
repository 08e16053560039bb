"""Parameters: described, with unit and range, and the shipped parameter file is accepted by all nodes."""

import json
import re
from pathlib import Path

import pytest
import yaml
from rcl_interfaces.srv import DescribeParameters
from safety import DEFAULT_LIMIT, PROMISED, Limits

from rhythmid.body.joint_experiment import JointSafety
from rhythmid.settings import Safety
from rhythmid.simulation.command_hold import RAMP
from rhythmid_nodes.command_guard import PARAMETERS as GUARD_PARAMETERS
from rhythmid_nodes.command_guard import CommandGuard
from rhythmid_nodes.delay_injector import PARAMETERS as DELAY_PARAMETERS
from rhythmid_nodes.delay_injector import DelayInjector
from rhythmid_nodes.excitation import PARAMETERS as EXCITATION_PARAMETERS
from rhythmid_nodes.excitation import ExcitationNode
from rhythmid_nodes.plant import PARAMETERS as PLANT_PARAMETERS
from rhythmid_nodes.plant import PlantNode
from rhythmid_nodes.recorder import PARAMETERS as RECORDER_PARAMETERS
from rhythmid_nodes.recorder import Recorder

ROOT = Path(__file__).parents[2]
CONFIG = ROOT / "ros_ws" / "src" / "rhythmid_bringup" / "config"
NODES = {
    "plant": (PlantNode, PLANT_PARAMETERS),
    "command_delay": (DelayInjector, DELAY_PARAMETERS),
    "measurement_delay": (DelayInjector, DELAY_PARAMETERS),
    "excitation": (ExcitationNode, EXCITATION_PARAMETERS),
    "recorder": (Recorder, RECORDER_PARAMETERS),
    "command_guard": (CommandGuard, GUARD_PARAMETERS),
}


def test_ros2_param_describe_shows_description_unit_and_range(graph):
    graph.add(DelayInjector, {"input": "here", "output": "there"})
    request = DescribeParameters.Request(names=["delay", "stamp_mode"])
    delay, mode = graph.call("delay_injector/describe_parameters", DescribeParameters, request).descriptors
    assert delay.description.endswith("[s]") and not delay.read_only
    assert (delay.floating_point_range[0].from_value, delay.floating_point_range[0].to_value) == (0.0, 10.0)
    assert "(arrival | keep)" in mode.description and mode.read_only


def test_a_read_only_parameter_cannot_be_set(graph):
    graph.add(DelayInjector, {"input": "here", "output": "there"})
    assert not graph.set_parameter("delay_injector", "stamp_mode", "keep").successful


@pytest.mark.parametrize("name", NODES)
def test_the_shipped_parameter_file_is_accepted(graph, tmp_path, monkeypatch, name):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "paper_hopper.yaml").write_text((CONFIG / "paper_hopper.yaml").read_text())
    build, _ = NODES[name]
    file = CONFIG / "hopper_params.yaml"

    def with_file(**options):
        options["cli_args"] += ["-r", f"__node:={name}", "--params-file", str(file)]
        return build(**options)

    node = graph.add(with_file, {"input": f"{name}_in", "output": f"{name}_out"})
    assert node.get_name() == name
    expected = {"command_delay": 0.040, "measurement_delay": 0.050}
    if name in expected:
        assert node.values["delay"] == expected[name]
    if name == "excitation":
        assert json.loads(node.values["excitation"])["type"] == "chirp" and node.values["max_effort"] == 0.1


def test_a_robots_limits_are_those_that_are_measured_and_the_defaults_are_a_simulated_plants():
    page = (ROOT / "docs" / "robot.md").read_text(encoding="utf-8")
    shown = re.search(r"```yaml\n(# robot.yaml\n.*?)```", page, re.DOTALL)
    assert shown is not None
    robot = {name: content["ros__parameters"] for name, content in yaml.safe_load(shown[1]).items()}
    proven = Limits.ROBOT.times
    assert robot["/**/excitation"]["stale_after"] == robot["/**/command_guard"]["stale_after"] == proven.stale
    assert robot["/**/command_guard"]["command_timeout"] == proven.command
    assert f"`frozen_after` | excitation | {proven.frozen} s" in page
    assert max(proven.stale, proven.frozen, proven.command + RAMP) < PROMISED
    for parameters in (EXCITATION_PARAMETERS, GUARD_PARAMETERS):
        assert {one.name: one.default for one in parameters}["stale_after"] == DEFAULT_LIMIT
    assert Safety().stale_after == JointSafety().stale_after == DEFAULT_LIMIT


@pytest.mark.parametrize("name", NODES)
def test_every_parameter_has_a_description(name):
    for parameter in NODES[name][1]:
        assert len(parameter.description) > 10, parameter.name
        assert parameter.default is not None or parameter.items is not None
