"""A design over real topics: the excitation node plays the file, sample by sample."""

import subprocess
import sys

import numpy as np
import pytest
from patience import LONG

from machines import HOPPER, hopper
from rhythmid.design.design_folder import COMMAND, EXPERIMENT, save_design
from rhythmid.design.designer import design
from rhythmid.design.requirements import Requirements
from rhythmid.experiment import Experiment
from rhythmid.record.read import load_records
from rhythmid_nodes.excitation import ExcitationNode

WANTED = Requirements(
    duration=16.0, band=(0.3, 6.0), max_effort=0.05, envelope=(0.1, 0.2), noise_std=2e-5, rate=250, harmonics=1,
    input_delay=0.0403, measurement_delay=0.0551,
)  # fmt: skip


@pytest.fixture
def plan(tmp_path):
    """A design's folder, and the efforts in its file."""
    save_design(design(hopper(), WANTED), HOPPER, tmp_path / "plan")
    table = np.loadtxt(tmp_path / "plan" / COMMAND, delimiter=",", skiprows=1)
    return tmp_path / "plan", table[:, 1]


def test_the_excitation_node_takes_the_designs_samples_as_they_are(graph, plan):
    folder, effort = plan
    spec = next(node for node in Experiment.load(folder / EXPERIMENT).nodes() if node.name == "excitation")
    node = graph.add(ExcitationNode, **spec.parameters)
    np.testing.assert_array_equal(node._effort, effort)


@pytest.mark.timeout(LONG)
def test_the_graph_records_the_designs_samples_and_a_motion_within_the_envelope(plan):
    folder, effort = plan
    done = subprocess.run(
        [sys.executable, "-m", "rhythmid.cli", "run", str(folder / EXPERIMENT), "--out", str(folder / "bag")],
        capture_output=True, text=True, timeout=LONG, cwd=folder, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    (record,) = load_records([folder / "bag"])
    np.testing.assert_array_equal(record.input.value, effort)
    assert record.run["excitation"] == {"type": "samples", "file": COMMAND}
    assert WANTED.envelope[0] < record.output.value.min() and record.output.value.max() < WANTED.envelope[1]
