"""What pyproject.toml cannot say: where colcon and the ament index look for the package."""

from setuptools import setup

setup(
    data_files=[
        ("share/ament_index/resource_index/packages", ["resource/rhythmid"]),
        ("share/rhythmid", ["package.xml"]),
    ]
)
