"""Starts the graph of an experiment with `ros2 launch`: the same nodes and parameters as `rhythmid run`.

    ros2 launch rhythmid_bringup experiment.launch.py experiment:=demo.yaml [bag:=out]

The launch configures and activates the excitation, which starts by itself when everything is ready and the recorder is active. The
other nodes activate themselves. When any node ends, everything is shut down, and the exit code is that of
the node (128 plus the signal's number if it was killed).
"""

import atexit
import os
import sys
from pathlib import Path

from launch import LaunchContext, LaunchDescription
from launch.actions import DeclareLaunchArgument, OpaqueFunction, Shutdown
from launch.events.process import ProcessExited
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import LifecycleNode, LifecycleTransition, Node
from lifecycle_msgs.msg import Transition

from rhythmid_bringup.arguments import given_parameters
from rhythmid_bringup.run import load

LED = {"unattended": True, "autostart": False}
"""Parameters of the excitation besides the experiment's."""


def shut_down(event: ProcessExited, context: LaunchContext) -> list[Shutdown]:
    """End the launch with the exit code of the node that ended first."""
    if context.is_shutdown:
        return []
    code = event.returncode
    if code != 0:
        atexit.register(_exit, code if code > 0 else 128 - code)
    return [Shutdown(reason=f"{event.process_name} ended with exit code {code}")]


def _exit(code: int) -> None:
    """Exit with `code`, because `ros2 launch` itself has only the exit codes 0 and 1."""
    sys.stdout.flush()
    sys.stderr.flush()
    os._exit(code)


def graph(context: LaunchContext) -> list[Node | LifecycleTransition]:
    """The experiment's nodes, and the transitions of the excitation."""
    bag = LaunchConfiguration("bag").perform(context)
    path = Path(LaunchConfiguration("experiment").perform(context))
    experiment = load(path, Path(bag) if bag else None)
    nodes: list[Node | LifecycleTransition] = []
    for spec in experiment.nodes():
        leads = spec.name == "excitation"
        nodes.append(
            LifecycleNode(
                package=spec.package,
                executable=spec.executable,
                name=spec.name,
                namespace=experiment.namespace,
                parameters=[{**given_parameters(spec), **(LED if leads else {})}],
                remappings=list(spec.remappings.items()),
                output="screen",
                on_exit=shut_down,
            )
        )
        if leads:
            nodes.append(
                LifecycleTransition(
                    lifecycle_node_names=[f"{experiment.namespace.rstrip('/')}/{spec.name}"],
                    transition_ids=[Transition.TRANSITION_CONFIGURE, Transition.TRANSITION_ACTIVATE],
                )
            )
    return nodes


def generate_launch_description() -> LaunchDescription:
    """Entry point of `ros2 launch`."""
    return LaunchDescription(
        [
            DeclareLaunchArgument("experiment", description="experiment file"),
            DeclareLaunchArgument(
                "bag", default_value="", description="bag to write; empty: as the file says"
            ),
            OpaqueFunction(function=graph),
        ]
    )
