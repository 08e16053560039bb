"""Integration tests of your own nodes: pytest fixtures that run the graph in simulated time with them.

    pytest_plugins = ["rhythmid.testing"]

    def test_my_filter(run_graph):
        run = run_graph("experiment.yaml", replace={"command_delay": "python my_filter.py"})
        assert run.identify().delays.input.value == pytest.approx(0.012, abs=1e-4)

Each run is `rhythmid run` in a process with its own DDS domain. Tests may run in parallel (pytest-xdist), and the test process
needs no ROS. docs/testing.md says what a node must do in simulated time.
"""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from importlib.resources import files
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
import yaml
from numpy.typing import NDArray

if TYPE_CHECKING:  # slow to load, and pytest loads this module also for tests that do not need it
    from rhythmid.diagnose.answer.result import Diagnosis
    from rhythmid.identify.identification import Identification
    from rhythmid.record.columns import Columns

TIMEOUT = 120.0  # seconds that a run may take; starting the nodes on a busy machine takes most of it
GRACE = 30.0  # seconds that a run which took too long has to end its nodes
PAPER_HOPPER = Path(str(files("rhythmid"))) / "models" / "paper_hopper.yaml"
STREAMS = ("excitation", "command", "forcing", "plant/joint_states", "joint_states", "run")


@dataclass(frozen=True)
class GraphRun:
    """A completed run.

    Attributes
    ----------
    bag : the recording.
    said : output of `rhythmid run`.
    namespace, joint : of the experiment.
    folder : folder to which names of model files are relative.

    Topics are named as in the experiment (`command`, `joint_states`), or in full.
    """

    bag: Path
    said: str
    namespace: str
    joint: str
    folder: Path

    def stamps(self, topic: str) -> NDArray[np.int64]:
        """Header stamps [ns] of a topic, int64[n], in the order of recording. Raises InputError where it was not recorded."""
        return self._columns(topic, "effort")[1]

    def values(self, topic: str, field: str) -> NDArray[np.float64]:
        """`position`, `velocity` or `effort` of the joint, float64[n], in the order of recording; NaN where a message has none."""
        columns, _ = self._columns(topic, field)
        return next(iter(columns.values.values()))

    def rate(self, topic: str) -> float:
        """Messages a second [Hz], by their stamps."""
        stamps = self.stamps(topic)
        return float((len(stamps) - 1) / (stamps[-1] - stamps[0]) * 1e9) if len(stamps) > 1 else 0.0

    def delay(self, source: str, target: str) -> NDArray[np.float64]:
        """By how much each message of `target` is stamped later than that of `source` [s], float64[n].

        Raises AssertionError when the two have not equally many messages.
        """
        sent, received = self.stamps(source), self.stamps(target)
        assert len(sent) == len(received), f"{len(sent)} messages of {source}, {len(received)} of {target}"
        return ((received - sent) * 1e-9).astype(np.float64)

    def identify(self, model: str | Path = PAPER_HOPPER) -> Identification:
        """Parameters and delays by `model`, by default the paper's hopper: what `rhythmid identify` finds. Raises InputError."""
        from rhythmid.identify.identify import identify
        from rhythmid.model import Model
        from rhythmid.record.read import read_record

        return identify(read_record(self.bag), Model.of_one_axis(self.folder / model))

    def diagnose(self, model: str | Path = PAPER_HOPPER, budget: float | None = None) -> Diagnosis:
        """Verdict about the nominal `model`, by default the paper's hopper: what `rhythmid diagnose` says.

        `budget` [s] limits the time of the diagnosis. Raises InputError.
        """
        from rhythmid.diagnose.diagnosis import diagnose
        from rhythmid.model import Model
        from rhythmid.record.read import read_record

        nominal = Model.of_one_axis(self.folder / model)
        return diagnose([read_record(self.bag)], nominal, budget=budget).diagnosis

    def _columns(self, topic: str, field: str) -> tuple[Columns, NDArray[np.int64]]:
        """One field of a topic, and its stamps."""
        from rhythmid.errors import InputError
        from rhythmid.record.bag import Bag
        from rhythmid.record.columns import read_columns
        from rhythmid.record.field import Field

        name = topic if topic.startswith("/") else f"{self.namespace}/{topic}"
        bag = Bag(self.bag)
        found = read_columns(bag.blocks(), {name: [Field.parse(f"{field}[{self.joint}]")]})
        if name not in found:
            raise InputError(
                f"no message of {name} in {self.bag}; its topics: {', '.join(sorted(bag.topics))}"
            )
        stamps = found[name].stamp_ns
        if stamps is None:
            raise InputError(f"messages of {name} bear no stamps")
        return found[name], stamps


RunGraph = Callable[..., GraphRun]


@pytest.fixture
def run_graph(request: pytest.FixtureRequest, tmp_path: Path) -> RunGraph:
    """A function that runs an experiment to its end, with your own nodes in the place of some nodes of the graph.

    Parameters of the function
    --------------------------
    experiment : an experiment file, or what stands in one. Then the model is the paper's hopper and all streams are recorded,
        unless it says otherwise. Names of files start at the folder of the test.
    replace : by the name of a node (`command_delay`, `measurement_delay`, `plant`) the command that runs in its place; it is run
        in the folder of the test, and `python` is the one that runs the tests.
    timeout : seconds that the run may take.

    The test fails, with what the nodes said, when the run does not come to its end. Raises InputError for an experiment that
    cannot be read.
    """
    folder = request.path.parent
    number = iter(range(1_000_000))

    def run(
        experiment: str | Path | Mapping[str, Any],
        replace: Mapping[str, str] | None = None,
        timeout: float = TIMEOUT,
    ) -> GraphRun:
        __tracebackhide__ = True  # a failure is shown at the test's own line
        from rhythmid.experiment import Experiment

        bag = tmp_path / f"graph_run_{next(number)}"
        path = bag.with_suffix(".yaml")
        if isinstance(experiment, Mapping):
            path.write_text(yaml.safe_dump(_completed(experiment, folder)), encoding="utf-8")
        else:
            path = folder / experiment
        given = Experiment.load(path)
        said = _run(["run", str(path), "--out", str(bag)], replace or {}, folder, timeout)
        return GraphRun(bag, said, given.namespace, given.joint, folder)

    return run


def _completed(experiment: Mapping[str, Any], folder: Path) -> dict[str, Any]:
    """An experiment with an absolute model path, and with all streams recorded."""
    model = folder / experiment["model"] if "model" in experiment else PAPER_HOPPER
    return {"record": {"topics": list(STREAMS)}, **experiment, "model": str(model)}


def _run(words: list[str], replace: Mapping[str, str], folder: Path, timeout: float) -> str:
    """Output of `rhythmid`; the test fails if it does not succeed within `timeout` seconds."""
    __tracebackhide__ = True
    environment = {key: value for key, value in os.environ.items() if key != "ROS_DOMAIN_ID"}
    environment["PATH"] = os.pathsep.join([str(Path(sys.executable).parent), environment.get("PATH", "")])
    for name, line in replace.items():
        words = [*words, "--replace", f"{name}={line}"]
    process = subprocess.Popen(
        [sys.executable, "-m", "rhythmid.cli", *words],
        cwd=folder, env=environment, stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, errors="replace",
    )  # fmt: skip
    late = False
    try:
        said, _ = process.communicate(timeout=timeout)
    except subprocess.TimeoutExpired:
        late = True
        said = _interrupted(process)
    except BaseException:  # such as the user's Ctrl-C: no node may outlive the test
        process.send_signal(signal.SIGINT)
        process.wait(GRACE)
        raise
    if late:
        pytest.fail(f"the run did not end within {timeout:g} s and was stopped:\n{said}")
    if process.returncode != 0:
        pytest.fail(f"rhythmid run ended with exit code {process.returncode}:\n{said}")
    return said


def _interrupted(process: subprocess.Popen[str]) -> str:
    """Stop a run that takes too long; what it said."""
    process.send_signal(signal.SIGINT)
    try:
        return process.communicate(timeout=GRACE)[0]
    except subprocess.TimeoutExpired:
        process.kill()
        return process.communicate()[0]
