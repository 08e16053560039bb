"""What pyproject.toml cannot say in a way that colcon and every setuptools since 68 understand."""

from setuptools import setup

setup(
    python_requires=">=3.11,<3.13",
    license="Apache-2.0",
    data_files=[
        ("share/ament_index/resource_index/packages", ["resource/rhythmid"]),
        ("share/rhythmid", ["package.xml"]),
    ],
)
