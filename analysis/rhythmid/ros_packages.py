"""Packages that a running graph needs besides this one; a missing package is reported in one line."""

from rhythmid.errors import InputError

INSTALL = (
    "run `make install` in rhythmid's folder, or there: "
    "pip install './analysis[ros]' ./ros_ws/src/rhythmid_nodes ./ros_ws/src/rhythmid_bringup"
)


def not_installed(what: str, package: str) -> InputError:
    """Message that `what` is not possible without a package, and how to install it."""
    return InputError(f"{what} needs ROS 2 and rhythmid's nodes: {package} is not installed; {INSTALL}")
