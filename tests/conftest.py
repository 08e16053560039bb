"""What all tests share: where compiled models and ROS logs go, how examples are drawn, and the command `rhythmid`."""

import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest
from hypothesis import settings

settings.register_profile("rhythmid", deadline=None, derandomize=True, database=None, max_examples=25)
settings.load_profile("rhythmid")

Command = Callable[..., subprocess.CompletedProcess[str]]


def pytest_configure(config: pytest.Config) -> None:
    """Keep compiled models from run to run, but apart from the user's own."""
    if getattr(config, "cache", None) is not None:
        os.environ.setdefault("RHYTHMID_CACHE", str(config.cache.mkdir("compiled")))


@pytest.fixture
def rhythmid(tmp_path: Path) -> Command:
    """The command line, run in `tmp_path`: rhythmid("check", bag) -> completed process with its output as text."""

    def run(*arguments: object, timeout: float = 120.0, **options) -> subprocess.CompletedProcess[str]:
        options.setdefault("cwd", tmp_path)
        return subprocess.run(
            [sys.executable, "-m", "rhythmid.cli", *map(str, arguments)],
            capture_output=True, text=True, timeout=timeout, check=False, **options,
        )  # fmt: skip

    return run
