"""A process that nobody asked: commands 5 N for some seconds, and says in JSON whom it reached and what it heard.

python stranger.py SECONDS [NAMESPACE]

The plant that it commands is in the namespace /hopper unless told otherwise.
"""

import json
import sys
import time

import rclpy
from rclpy.node import Node
from sensor_msgs.msg import JointState


def main() -> None:
    namespace = sys.argv[2] if len(sys.argv) > 2 else "hopper"
    rclpy.init()
    node = Node("stranger")
    heard: list[JointState] = []
    node.create_subscription(JointState, f"/{namespace}/plant/joint_states", heard.append, 10)
    publisher = node.create_publisher(JointState, f"/{namespace}/command", 10)
    reached = 0
    end = time.monotonic() + float(sys.argv[1])
    while time.monotonic() < end and not (reached and heard):
        message = JointState(name=["leg"], effort=[5.0])
        message.header.stamp = node.get_clock().now().to_msg()
        publisher.publish(message)
        reached = max(reached, publisher.get_subscription_count())
        rclpy.spin_once(node, timeout_sec=0.02)
    print(json.dumps({"reached": reached, "heard": len(heard), "nodes": node.get_node_names()}))


if __name__ == "__main__":
    main()
