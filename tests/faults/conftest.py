"""What the tests of bad input share: bags that can be spoilt."""

import resource
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from fuzz import MEMORY_LIMIT

from rhythmid.record.bag_writer import write_bag
from rhythmid.record.messages import Messages

SECONDS = 10.0  # of the processor that a few hostile kB may take: without the limits it would be hours
N = 3000
STAMPS = np.arange(N, dtype=np.int64) * 1_000_000
TIME = 1e-9 * STAMPS
RUN = {"namespace": "/hopper", "joint": "leg", "forcing": {"amplitude": 1.0, "frequency": 1.0, "phase": 0.0}}


def good_topics() -> dict[str, Messages]:
    """Three seconds of a hopper, as the recorder would keep them."""
    return {
        "excitation": Messages(STAMPS, effort=0.3 * np.sin(2 * np.pi * 2.3 * TIME**2)),
        "forcing": Messages(STAMPS, effort=np.cos(2 * np.pi * TIME)),
        "joint_states": Messages(STAMPS, position=0.15 + 0.01 * np.cos(2 * np.pi * TIME - 0.3)),
    }


@pytest.fixture
def topics() -> dict[str, Messages]:
    return good_topics()


@pytest.fixture
def bag(tmp_path) -> Callable[..., Path]:
    """bag(topics, name="bag", …): the topics as a bag in `tmp_path`."""

    def write(topics: dict[str, Messages], name: str = "bag", **options) -> Path:
        return write_bag(tmp_path / name, topics, **options)

    return write


@pytest.fixture(scope="session")
def good_bag(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The bag of `good_topics`, for tests that only need one to be there: they copy it."""
    return write_bag(tmp_path_factory.mktemp("good") / "bag", good_topics())


@pytest.fixture
def bounded():
    """The test takes little time and memory; the process gets no more."""
    before, begun = resource.getrlimit(resource.RLIMIT_AS), time.process_time()
    with open("/proc/self/statm", encoding="ascii") as file:
        used = int(file.read().split()[0]) * resource.getpagesize()
    resource.setrlimit(resource.RLIMIT_AS, (used + (2 * MEMORY_LIMIT << 20), before[1]))
    yield
    resource.setrlimit(resource.RLIMIT_AS, before)
    assert time.process_time() - begun < SECONDS
