"""A DDS domain for each test, nodes in the test's own process or in processes of their own, and a probe to talk to them."""

from __future__ import annotations

import os
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import pytest
import rclpy
import yaml
from patience import PATIENCE
from rcl_interfaces.srv import SetParameters
from rclpy.experimental.events_executor import EventsExecutor
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.qos import QoSProfile
from rclpy.utilities import try_shutdown
from read_back import require_readable_by_others
from sensor_msgs.msg import JointState
from std_srvs.srv import Trigger

from rhythmid_bringup.environment import own_domain, run_environment
from rhythmid_bringup.processes import Supervised, end
from rhythmid_nodes.node import GraphNode
from rhythmid_nodes.qos import stream


class Graph:
    """Nodes under test, and a probe that sees and sends messages; everything lives in one DDS domain."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.said: list[str] = []
        self.nodes: list[GraphNode] = []
        self.processes: list[Supervised] = []
        self.probe = Node("probe", namespace="/hopper")
        self.executor = EventsExecutor()
        self.executor.add_node(self.probe)

    # Nodes

    def add(
        self, build: Callable[..., GraphNode], remap: dict[str, str] | None = None, **parameters: Any
    ) -> Any:
        """A node in this process."""
        arguments = ["--ros-args", "-r", "__ns:=/hopper"]
        for source, target in (remap or {}).items():
            arguments += ["-r", f"{source}:={target}"]
        node = build(
            cli_args=arguments,
            use_global_arguments=False,
            parameter_overrides=[Parameter(name, value=value) for name, value in parameters.items()],
        )
        self.nodes.append(node)
        self.executor.add_node(node)
        node.begin()
        return node

    def spawn(
        self, executable: str, name: str, remap: dict[str, str] | None = None, **parameters: Any
    ) -> Supervised:
        """A node in a process of its own."""
        path = self.folder / f"{name}.yaml"
        path.write_text(yaml.safe_dump({"/**": {"ros__parameters": parameters}}, width=2**16))
        command = [
            sys.executable,
            "-m",
            f"rhythmid_nodes.{executable}",
            "--ros-args",
            "--params-file",
            str(path),
        ]
        for source, target in {"__ns": "/hopper", "__node": name, **(remap or {})}.items():
            command += ["-r", f"{source}:={target}"]
        process = Supervised(name, command, os.environ, lambda _name, line: self.said.append(line))
        self.processes.append(process)
        return process

    # Messages

    @staticmethod
    def joint_state(stamp_ns: int, **fields: float) -> JointState:
        """A message of the joint `leg`."""
        message = JointState(name=["leg"], **{name: [value] for name, value in fields.items()})
        message.header.stamp.sec, message.header.stamp.nanosec = divmod(stamp_ns, 1_000_000_000)
        return message

    def listen(self, topic: str, message_type: type = JointState, qos: QoSProfile | None = None) -> list[Any]:
        """A list that fills with the messages of a topic."""
        heard: list[Any] = []
        self.probe.create_subscription(message_type, topic, heard.append, qos or stream(lockstep=False))
        return heard

    def talk(
        self, topic: str, message_type: type = JointState, qos: QoSProfile | None = None
    ) -> Callable[[Any], None]:
        """A function that publishes on a topic, once somebody listens."""
        publisher = self.probe.create_publisher(message_type, topic, qos or stream(lockstep=False))
        self.until(lambda: publisher.get_subscription_count() > 0, f"a subscriber of {topic}")
        return publisher.publish

    def call(self, service: str, service_type: type = Trigger, request: Any = None) -> Any:
        """The answer of a service."""
        client = self.probe.create_client(service_type, service)
        self.until(client.service_is_ready, f"service {service}")
        future = client.call_async(request or service_type.Request())
        self.until(future.done, f"an answer of {service}")
        return future.result()

    def set_parameter(self, node: str, name: str, value: Any) -> Any:
        """What `ros2 param set` does: the result with `successful` and `reason`."""
        request = SetParameters.Request(parameters=[Parameter(name, value=value).to_parameter_msg()])
        return self.call(f"{node}/set_parameters", SetParameters, request).results[0]

    # Time

    def until(self, condition: Callable[[], Any], what: str, timeout: float = PATIENCE) -> None:
        """Serve callbacks until the condition holds; fails when it takes too long."""
        patience = time.monotonic() + timeout
        while not condition():
            assert time.monotonic() < patience, f"no {what} within {timeout:g} s; said: {self.said[-5:]}"
            self.executor.spin_once(timeout_sec=0.02)

    def spin(self, seconds: float) -> None:
        """Serve callbacks for a while."""
        patience = time.monotonic() + seconds
        while time.monotonic() < patience:
            self.executor.spin_once(timeout_sec=0.005)

    def silence(self, heard: Sequence[Any], seconds: float = 0.3) -> int:
        """Serve callbacks until a list has not grown for a while, and tell its length."""
        count = -1
        while count != len(heard):
            count = len(heard)
            self.spin(seconds)
            for _ in range(10):  # a stall may have used up the time
                self.executor.spin_once(timeout_sec=0.01)
        return count

    def close(self) -> None:
        for node in self.nodes:
            node.close()
        end(self.processes)
        self.executor.shutdown()  # while it lives, so do the nodes' connections, and a later test might hear them
        for node in (*self.nodes, self.probe):
            node.destroy_node()


@pytest.fixture
def domain(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[int]:
    """A DDS domain that nobody else uses, set for this process and its children."""
    for name in ("ROS_DOMAIN_ID", "ROS_LOCALHOST_ONLY"):
        monkeypatch.delenv(name, raising=False)
    with own_domain() as number:
        for name, value in run_environment(os.environ, number, tmp_path / "log").items():
            monkeypatch.setenv(name, value)
        yield number


@pytest.fixture
def graph(domain: int, tmp_path: Path) -> Iterator[Graph]:
    """An empty graph."""
    with ExitStack() as stack:
        rclpy.init(args=[])
        stack.callback(try_shutdown)
        made = Graph(tmp_path)
        stack.callback(made.close)
        yield made


@pytest.fixture
def no_shared_memory(monkeypatch: pytest.MonkeyPatch) -> None:
    """For processes that are going to be killed: they would leave their shared memory behind."""
    monkeypatch.setenv("FASTDDS_BUILTIN_TRANSPORTS", "UDPv4")


@pytest.fixture(autouse=True)
def every_bag_is_readable_by_others(tmp_path: Path) -> Iterator[None]:
    """Whatever bag a test leaves, rosbags and mcap read every message of it."""
    yield
    for metadata in tmp_path.rglob("metadata.yaml"):
        require_readable_by_others(metadata.parent)
