"""rhythmid_nodes as an ament_python package; pip installs it as well."""

from setuptools import find_packages, setup

NAME = "rhythmid_nodes"

setup(
    name=NAME,
    version="0.1.0",
    packages=find_packages(include=[NAME, f"{NAME}.*"]),
    data_files=[
        ("share/ament_index/resource_index/packages", [f"resource/{NAME}"]),
        (f"share/{NAME}", ["package.xml"]),
    ],
    install_requires=["setuptools", "numpy", "rosbags", "rhythmid"],
    zip_safe=True,
    maintainer="The rhythmid authors",
    maintainer_email="rhythmid@example.org",
    description="Plant, excitation, delay injector and recorder for the identification of rhythmic machines.",
    license="Apache-2.0",
    entry_points={
        "console_scripts": [
            "plant = rhythmid_nodes.plant:main",
            "excitation = rhythmid_nodes.excitation:main",
            "joint_plant = rhythmid_nodes.joint_plant:main",
            "joint_excitation = rhythmid_nodes.joint_excitation:main",
            "delay_injector = rhythmid_nodes.delay_injector:main",
            "recorder = rhythmid_nodes.recorder:main",
            "command_guard = rhythmid_nodes.command_guard:main",
            "twin = rhythmid_nodes.twin:main",
        ],
    },
)
