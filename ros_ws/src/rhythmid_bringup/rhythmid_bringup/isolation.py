"""A separate network for a command and its children: no other process on this computer can reach their nodes.

    python -m rhythmid_bringup.isolation COMMAND [ARGUMENT …]

ROS 2 without SROS2 trusts every participant of its domain, and the wheels' DDS is built without security. Linux namespaces (see
namespaces(7)) are used instead: one for the network, which contains only its own loopback, and one for mounts with a separate
/dev/shm, through which DDS transfers messages. A user without the right to create them gets a user namespace around both,
if the system allows it. Neither other users nor other programs of the same user can reach the nodes. Other actions of the same
user, such as signals and files, are not prevented.
"""

from __future__ import annotations

import fcntl
import os
import shutil
import socket
import struct
import subprocess
import sys
from collections.abc import Sequence

from rhythmid.errors import InputError

SIOCGIFFLAGS, SIOCSIFFLAGS = 0x8913, 0x8914  # linux/sockios.h: read and set the flags of a network interface
IFF_UP = 0x1  # linux/if.h
_REQUEST = struct.Struct("16sH14x")  # struct ifreq: name of the interface, flags
_MODULE = "rhythmid_bringup.isolation"  # as Python runs it, which changes its own name
_INSIDE = "--inside"  # first argument of this module once it runs within the namespaces


def isolated(command: Sequence[str]) -> list[str]:
    """The command line that runs `command` isolated. Raises InputError with the reason if this computer does not allow it."""
    if (reason := why_not()) is not None:
        raise InputError(
            f"nodes cannot be isolated on this machine: {reason}; use a container with a network of its own"
        )
    return [*_unshare(), sys.executable, "-m", _MODULE, _INSIDE, *command]


def why_not() -> str | None:
    """Why this user cannot isolate processes on this computer; None if it is possible."""
    if shutil.which("unshare") is None:
        return "the program unshare (util-linux) is missing"
    tried = subprocess.run(
        [*_unshare(), "mount", "-t", "tmpfs", "tmpfs", "/dev/shm"],
        capture_output=True,
        text=True,
        check=False,
    )
    return None if tried.returncode == 0 else " ".join(tried.stderr.split()) or "unshare failed"


def _unshare() -> list[str]:
    user = [] if os.geteuid() == 0 else ["--user", "--map-root-user"]
    return ["unshare", *user, "--net", "--mount", "--ipc", "--"]


def _enter() -> None:
    """Prepare the new namespaces: switch the loopback on, and mount an empty folder over the shared memory of other processes."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as control:
        answer = fcntl.ioctl(control, SIOCGIFFLAGS, _REQUEST.pack(b"lo", 0))
        flags = _REQUEST.unpack(answer)[1]
        fcntl.ioctl(control, SIOCSIFFLAGS, _REQUEST.pack(b"lo", flags | IFF_UP))
    subprocess.run(["mount", "-t", "tmpfs", "tmpfs", "/dev/shm"], check=True)


def main() -> int:
    """Entry point: run the arguments isolated, in place of this process."""
    command = sys.argv[1:]
    if not command:
        print("usage: python -m rhythmid_bringup.isolation COMMAND [ARGUMENT …]", file=sys.stderr)
        return 2
    try:
        if command[0] == _INSIDE:
            command = command[1:]
            _enter()
        else:
            command = isolated(command)
        os.execvp(command[0], command)
    except InputError as error:
        print(f"error: {error}", file=sys.stderr)
    except (OSError, subprocess.CalledProcessError) as error:
        print(f"error: {command[0]}: cannot be run isolated: {error}", file=sys.stderr)
    return 2


if __name__ == "__main__":
    sys.exit(main())
