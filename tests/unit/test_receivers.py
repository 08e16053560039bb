"""A command is received by a node that subscribes with its type, and by no recorder."""

import pytest

from rhythmid_nodes.receivers import nobody_receives

KIND, OTHER = "std_msgs/msg/Float64", "std_msgs/msg/Float64MultiArray"
NOBODY = f"no subscriber of /arm/forces [{KIND}]"
SERVICES = {"/recorder/split_bagfile", "/recorder/pause", "/arm/get_state"}


@pytest.mark.parametrize(
    ("subscribers", "matched", "told"),
    [
        ([], 0, NOBODY),
        ([("/arm", KIND)], 1, ""),
        ([("/arm", OTHER)], 0, f"{NOBODY} (/arm subscribes with {OTHER})"),
        ([("/recorder", KIND)], 1, NOBODY),
        ([("/recorder", KIND), ("/arm", OTHER)], 1, f"{NOBODY} (/arm subscribes with {OTHER})"),
        ([("/_ros2cli_17", KIND)], 1, NOBODY),
        ([("/recorder", KIND), ("/arm", KIND)], 2, ""),
        ([("/arm", KIND)], 0, f"{NOBODY} (/arm subscribes with another quality of service)"),
        (
            [("/recorder", KIND), ("/arm", KIND)],
            1,
            f"{NOBODY} (/arm subscribes with another quality of service)",
        ),
    ],
)
def test_only_a_connected_node_that_is_no_recorder_receives(subscribers, matched, told):
    assert nobody_receives("/arm/forces", KIND, subscribers, matched, SERVICES) == told
