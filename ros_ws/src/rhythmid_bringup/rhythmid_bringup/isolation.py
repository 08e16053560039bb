"""A network of its own for a command and its children: no other process of this machine can talk to their nodes.

    python -m rhythmid_bringup.isolation COMMAND [ARGUMENT …]

ROS 2 without SROS2 believes whoever speaks on its domain, and the wheels' DDS is built without security. Linux namespaces (see
namespaces(7)) take the place: one for the network, with nothing in it but its own loopback, and one for mounts with a /dev/shm of
its own, where DDS hands messages over. A user without the right to make them gets a user namespace around both,
where the system allows it. Neither other users nor other programs of the same user are heard; what the same user does by other
means than ROS, such as signals and files, is not prevented.
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
_MODULE = "rhythmid_bringup.isolation"  # as Python runs it; its own name is another then
_INSIDE = "--inside"  # first argument of this module once it runs within the namespaces


def isolated(command: Sequence[str]) -> list[str]:
    """The command line that runs `command` isolated. Raises InputError where this machine does not allow it, with the reason."""
    if (reason := why_not()) is not None:
        raise InputError(
            f"nodes cannot be isolated on this machine: {reason}; use a container with a network of its own"
        )
    return [*_unshare(), sys.executable, "-m", _MODULE, _INSIDE, *command]


def why_not() -> str | None:
    """Why this machine does not let this user isolate processes; None where it does."""
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
    """Make the new namespaces usable: switch the loopback on, and put an empty folder over the shared memory of others."""
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
