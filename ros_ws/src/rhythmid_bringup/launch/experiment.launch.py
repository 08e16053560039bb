"""Starts the graph of an experiment with `ros2 launch`: the same nodes and parameters as `rhythmid run`.

    ros2 launch rhythmid_bringup experiment.launch.py experiment:=demo.yaml [bag:=out]

The excitation starts by itself when it is ready; when it has ended, everything is shut down.
"""

from pathlib import Path

from launch import LaunchContext, LaunchDescription
from launch.actions import DeclareLaunchArgument, OpaqueFunction, Shutdown
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node

from rhythmid_bringup.arguments import given_parameters
from rhythmid_bringup.run import load


def graph(context: LaunchContext) -> list[Node]:
    """The experiment's nodes."""
    bag = LaunchConfiguration("bag").perform(context)
    path = Path(LaunchConfiguration("experiment").perform(context))
    experiment = load(path, Path(bag) if bag else None)
    nodes = []
    for spec in experiment.nodes():
        leads = spec.executable == "excitation"
        nodes.append(
            Node(
                package=spec.package,
                executable=spec.executable,
                name=spec.name,
                namespace=experiment.namespace,
                parameters=[{**given_parameters(spec), **({"unattended": True} if leads else {})}],
                remappings=list(spec.remappings.items()),
                output="screen",
                on_exit=[Shutdown()] if leads else None,
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
