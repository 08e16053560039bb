"""What the tools of ROS expect of our files: requirements with rosdep keys, layouts that name our topics, the bag's distribution."""

import json
import re
import tomllib
import xml.etree.ElementTree as ElementTree
from pathlib import Path

import pytest
import yaml

from rhythmid.record.bag_writer import new_bag

ROOT = Path(__file__).parents[2]
BRINGUP = ROOT / "ros_ws" / "src" / "rhythmid_bringup"
# keys of rosdep's own list, and packages of ROS and of this workspace
KNOWN = {
    "ament_index_python", "diagnostic_msgs", "launch", "launch_ros", "lifecycle_msgs", "rcl_interfaces", "rclpy", "rhythmid", "rhythmid_nodes",
    "sensor_msgs", "std_msgs", "std_srvs", "python3-matplotlib", "python3-numpy", "python3-pytest", "python3-scipy", "python3-yaml",
}  # fmt: skip
NAMED_OTHERWISE = {"pyyaml": "yaml"}


def keys(manifest: Path) -> set[str]:
    """What a package.xml depends on."""
    found = ElementTree.parse(manifest).getroot().iter()
    return {one.text for one in found if one.tag.endswith("depend") and one.text}


def own_keys() -> dict:
    return yaml.safe_load((ROOT / "ros_ws" / "rosdep.yaml").read_text(encoding="utf-8"))


def test_every_requirement_of_the_package_has_a_rosdep_key():
    project = tomllib.loads((ROOT / "analysis" / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    given = keys(ROOT / "analysis" / "package.xml")
    for requirement in project["dependencies"]:
        name = re.split(r"[^\w.-]", requirement)[0].lower().replace(".", "-")
        key = f"python3-{NAMED_OTHERWISE.get(name, name)}"
        assert given & {key, f"{key}-pip"}, requirement


def test_every_rosdep_key_is_known():
    used = set()
    for manifest in [ROOT / "analysis" / "package.xml", *(ROOT / "ros_ws" / "src").glob("*/package.xml")]:
        used |= keys(manifest)
    assert used <= KNOWN | set(own_keys())
    assert set(own_keys()) <= used


def test_our_own_rosdep_keys_name_one_package_of_pip_each():
    for key, rules in own_keys().items():
        name = key.removeprefix("python3-").removesuffix("-pip")
        assert rules == {system: {"pip": {"packages": [name]}} for system in ("ubuntu", "debian")}


def test_the_foxglove_layout_shows_what_the_plotjuggler_layout_shows():
    layout = json.loads((BRINGUP / "layouts" / "hopper.foxglove.json").read_text(encoding="utf-8"))
    panels = layout["configById"]

    def leaves(node):
        return [node] if isinstance(node, str) else [*leaves(node["first"]), *leaves(node["second"])]

    assert sorted(leaves(layout["layout"])) == sorted(panels)
    shown = set(re.findall(r'"(/hopper/[\w/]+)\.(\w+)\[0\]"', json.dumps(panels)))
    curves = ElementTree.parse(BRINGUP / "layouts" / "hopper.xml").getroot().iter("curve")
    names = [value for curve in curves for value in curve.attrib.values() if value.startswith("/hopper/")]
    assert shown == {tuple(name.rsplit("/leg/", 1)) for name in names}


def test_the_aggregator_collects_the_statuses_by_the_prefix_that_they_have():
    pytest.importorskip("rclpy")
    from rhythmid_nodes.diagnostics import PREFIX, status_name

    text = (BRINGUP / "config" / "diagnostic_aggregator.yaml").read_text(encoding="utf-8")
    analyzer = yaml.safe_load(text)["analyzers"]["ros__parameters"]["rhythmid"]
    assert analyzer["startswith"] == analyzer["remove_prefix"] == [PREFIX]
    assert status_name("/hopper/plant") == "rhythmid: hopper/plant"


def test_a_bag_names_the_distribution_whose_types_it_has(tmp_path):
    with new_bag(tmp_path / "bag"):
        pass
    information = yaml.safe_load((tmp_path / "bag" / "metadata.yaml").read_text())
    assert information["rosbag2_bagfile_information"]["ros_distro"] == "jazzy"


def test_a_recorder_names_the_distribution_that_runs(tmp_path, monkeypatch):
    pytest.importorskip("rclpy")
    from rhythmid_nodes.bag import LiveBag, Storage

    monkeypatch.setenv("ROS_DISTRO", "kilted")
    bag = LiveBag(Storage(tmp_path / "bag"))
    bag.open()
    bag.stop()
    text = (tmp_path / "bag" / "metadata.yaml").read_text()
    assert yaml.safe_load(text)["rosbag2_bagfile_information"]["ros_distro"] == "kilted"
