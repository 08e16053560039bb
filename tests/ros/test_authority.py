"""One node commands a topic: another that takes its place is named, and the same node may come back."""

import pytest
from patience import LONG
from rclpy.node import Node
from sensor_msgs.msg import JointState

from rhythmid_nodes.authority import Authority

TOPIC = "/hopper/command"
pytestmark = pytest.mark.timeout(LONG)


class Guarded:
    """A node that watches who commands, and what it was told."""

    def __init__(self, graph):
        self.graph, self.told, self._number = graph, [], 0
        self.authority = Authority(graph.probe, TOPIC, self.told.append)

    def hears(self, commander):
        """One command, of a node with one publisher, as the middleware announces it."""
        self._number += 1
        self.graph.until(lambda: self._commanders() == [commander], f"only {commander}")
        assert self.authority.admits({"publication_sequence_number": self._number})
        self.authority._look()

    def _commanders(self):
        return [one.node_name for one in self.graph.probe.get_publishers_info_by_topic(TOPIC)]


@pytest.fixture
def guarded(graph):
    return Guarded(graph)


@pytest.fixture
def commander():
    made = []

    def run(name):
        for node in made:
            node.destroy_node()
        made[:] = [Node(name, namespace="/lab")]
        made[0].create_publisher(JointState, TOPIC, 10)

    yield run
    for node in made:
        node.destroy_node()


def test_another_node_in_the_place_of_the_first_is_named(guarded, commander):
    commander("excitation")
    guarded.hears("excitation")
    assert guarded.told == []
    commander("rogue")
    guarded.hears("rogue")
    assert guarded.told == [f"/lab/rogue publishes on {TOPIC} in place of /lab/excitation"]


def test_the_same_node_may_come_back(guarded, commander):
    for _ in range(2):
        commander("excitation")
        guarded.hears("excitation")
    assert guarded.told == []
