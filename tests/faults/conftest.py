"""What the tests of bad input share: the command line called within this process, and bags that can be spoilt."""

import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

from rhythmid import cli
from rhythmid.record.bag_writer import write_bag
from rhythmid.record.messages import Messages

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


@dataclass(frozen=True)
class Answer:
    """What a call of the command left behind."""

    code: int
    out: str
    err: str


@pytest.fixture
def command(capsys, monkeypatch, tmp_path) -> Callable[..., Answer]:
    """command("check", bag): the entry point of the command, called in `tmp_path`."""

    def call(*arguments: object) -> Answer:
        monkeypatch.chdir(tmp_path)
        monkeypatch.setattr(sys, "argv", ["rhythmid", *map(str, arguments)])
        capsys.readouterr()
        with pytest.raises(SystemExit) as ended:
            cli.main()
        said = capsys.readouterr()
        return Answer(ended.value.code, said.out, said.err)

    return call


@pytest.fixture
def refused(command) -> Callable[..., str]:
    """refused("check", bag): the one line with which a call is refused; fails where it is not, or not in that way."""

    def call(*arguments: object) -> str:
        answer = command(*arguments)
        assert answer.code == 2, answer
        assert answer.err.startswith("error: ") and answer.err.count("\n") == 1, answer.err
        return answer.err.removeprefix("error: ").rstrip("\n")

    return call


@pytest.fixture
def bag(tmp_path) -> Callable[..., Path]:
    """bag(topics, name="bag", …): the topics as a bag in `tmp_path`."""

    def write(topics: dict[str, Messages], name: str = "bag", **options) -> Path:
        return write_bag(tmp_path / name, topics, **options)

    return write
