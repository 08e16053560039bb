"""What a running graph needs besides this package, said in one line where it is missing."""

from rhythmid.errors import InputError

INSTALL = (
    "run `make install` in rhythmid's folder, or there: "
    "pip install './analysis[ros]' ./ros_ws/src/rhythmid_nodes ./ros_ws/src/rhythmid_bringup"
)


def not_installed(what: str, package: str) -> InputError:
    """That `what` cannot be done for want of a package, and how to install it."""
    return InputError(f"{what} needs ROS 2 and rhythmid's nodes: {package} is not installed; {INSTALL}")
