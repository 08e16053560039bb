"""rhythmid_bringup as an ament_python package; pip installs it as well."""

from glob import glob

from setuptools import find_packages, setup

NAME = "rhythmid_bringup"

setup(
    name=NAME,
    version="0.1.0",
    packages=find_packages(include=[NAME, f"{NAME}.*"]),
    package_data={NAME: ["*.xml"]},
    data_files=[
        ("share/ament_index/resource_index/packages", [f"resource/{NAME}"]),
        (f"share/{NAME}", ["package.xml"]),
        (f"share/{NAME}/launch", glob("launch/*.py")),
        (f"share/{NAME}/config", glob("config/*.yaml")),
        (f"share/{NAME}/layouts", glob("layouts/*")),
    ],
    install_requires=["setuptools", "PyYAML", "rich", "typer", "rhythmid", "rhythmid_nodes"],
    zip_safe=True,
    maintainer="The rhythmid authors",
    maintainer_email="rhythmid@example.org",
    description="Launch file, example experiments, layouts and the command rhythmid run.",
    license="Apache-2.0",
    entry_points={
        "rhythmid.commands": ["run = rhythmid_bringup.command:add"],
        "rhythmid.live": ["watch = rhythmid_bringup.watch:watch"],
    },
)
