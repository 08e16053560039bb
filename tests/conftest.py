"""What all tests share: where compiled models go, how examples are drawn, and the command `rhythmid`, as a process or within this one."""

import os
import signal
import subprocess
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import pytest
from hypothesis import settings
from patience import LONG

from rhythmid import cli, parallel

os.environ.setdefault(
    "OMP_NUM_THREADS", "1"
)  # before numpy: every worker has a core, and threads would wait for each other

settings.register_profile("rhythmid", deadline=None, derandomize=True, database=None, max_examples=40)
settings.load_profile("rhythmid")

LONGEST = (  # files that take more than about twenty seconds of the processor
    "ros/test_run.py", "ros/test_foreign_robot.py", "ros/test_tour.py", "ros/test_testing.py", "ros/test_realtime_delays.py",
    "ros/test_lockstep_run.py",
    "ros/test_workspace.py",
    "unit/test_effort_search.py", "unit/test_element_recorded.py", "faults/test_bad_input.py", "proof/test_machines.py",
    "unit/test_plausibility.py", "faults/test_diagnose_bad_input.py", "unit/test_twin_diagnosis.py", "unit/test_tick_interval.py",
    "unit/test_record_zeros.py", "unit/test_identifiability.py", "unit/test_identify_identify.py", "proof/test_draw.py",
    "faults/test_bad_records.py", "unit/test_link_evidence.py", "unit/test_packaging.py", "faults/test_interrupted.py",
    "unit/test_joint_plausibility.py", "unit/test_alternatives.py", "proof/test_notebooks.py", "unit/test_element_catalogue.py",
    "unit/test_held_reference.py", "unit/test_scoring.py", "unit/test_timing.py", "unit/test_table1.py", "unit/test_tick_scan.py",
    "unit/test_inner_delays.py", "unit/test_start_balance.py", "unit/test_reference_scale.py", "unit/test_diagnosis.py",
)  # fmt: skip

Command = Callable[..., subprocess.CompletedProcess[str]]


def pytest_configure(config: pytest.Config) -> None:
    """Keep compiled models from run to run, but apart from the user's own; let Ctrl-C do what it does on a terminal."""
    # a shell without job control starts background processes that ignore it, and so would the commands under test
    signal.signal(signal.SIGINT, signal.default_int_handler)
    if getattr(config, "cache", None) is not None:
        os.environ.setdefault("RHYTHMID_CACHE", str(config.cache.mkdir("compiled")))
    # the processors are in use by the other workers, and each further process would load the compiled models again
    if "PYTEST_XDIST_WORKER" in os.environ:
        parallel.cores = lambda: 1


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Begin with the files that take longest, so that of two workers neither ends long after the other."""
    places = {name: place for place, name in enumerate(LONGEST)}
    items.sort(key=lambda item: places.get("/".join(item.path.parts[-2:]), len(LONGEST)))


@pytest.fixture
def processors(monkeypatch: pytest.MonkeyPatch) -> None:
    """Two processors, for what a diagnosis in several processes promises."""
    monkeypatch.setattr(parallel, "cores", lambda: 2)


@pytest.fixture
def rhythmid(tmp_path: Path) -> Command:
    """The command line, run in `tmp_path`: rhythmid("check", bag) -> completed process with its output as text."""

    def run(*arguments: object, timeout: float = LONG, **options) -> subprocess.CompletedProcess[str]:
        options.setdefault("cwd", tmp_path)
        return subprocess.run(
            [sys.executable, "-m", "rhythmid.cli", *map(str, arguments)],
            capture_output=True, text=True, timeout=timeout, check=False, **options,
        )  # fmt: skip

    return run


@dataclass(frozen=True)
class Answer:
    """What a call of the command left behind."""

    code: int
    out: str
    err: str


@pytest.fixture
def command(capsys, monkeypatch, tmp_path) -> Callable[..., Answer]:
    """command("check", bag): the entry point of the command, called in `tmp_path` or in the folder `cwd`.

    It spares the start of a process, which takes about a second of the processor; `rhythmid` is for what a process proves.
    """

    def call(*arguments: object, cwd: Path = tmp_path) -> Answer:
        monkeypatch.chdir(cwd)
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
