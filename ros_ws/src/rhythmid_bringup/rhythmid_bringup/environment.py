"""The environment of a run: a separate DDS domain on this computer, quick discovery, logs in a separate folder."""

from __future__ import annotations

import os
import random
import socket
import sys
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path

from rhythmid.errors import InputError

_DOMAINS = range(1, 101)  # Linux has ports for the domains 0 to 101; 0 is the default of all programs
_LOCK_PORT = 22119  # port + domain, bound while a domain is taken; ament's domain_coordinator uses the same
_FAST_DISCOVERY = Path(__file__).with_name("fastdds.xml")


@contextmanager
def own_domain() -> Iterator[int]:
    """A DDS domain id that no other run on this computer uses; it is released at the end of the block.

    Raises InputError when all are taken.
    """
    for domain in random.sample(_DOMAINS, len(_DOMAINS)):
        with socket.socket() as lock:
            try:
                lock.bind(("127.0.0.1", _LOCK_PORT + domain))
            except OSError:
                continue
            yield domain
            return
    raise InputError(f"all {len(_DOMAINS)} DDS domains are taken on this machine; set ROS_DOMAIN_ID yourself")


def run_environment(given: Mapping[str, str], domain: int | None, log_folder: Path) -> dict[str, str]:
    """`given` with the variables that a run needs; variables that the user has set are unchanged.

    Without `domain` the nodes run without a supervisor, in the default domain. Nodes are discovered on this computer only, unless
    the user has set otherwise.
    """
    environment = {
        "ROS_LOG_DIR": str(log_folder),
        "FASTRTPS_DEFAULT_PROFILES_FILE": str(_FAST_DISCOVERY),
        "AMENT_PREFIX_PATH": sys.prefix,  # the ROS wheels do not set it
        "PYTHONUNBUFFERED": "1",
    }
    if domain is not None:
        environment |= {"ROS_DOMAIN_ID": str(domain), "RHYTHMID_SUPERVISOR": str(os.getpid())}
    if "ROS_LOCALHOST_ONLY" not in given:
        environment["ROS_AUTOMATIC_DISCOVERY_RANGE"] = "LOCALHOST"
    return {**environment, **given}
