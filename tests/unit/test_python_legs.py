"""Machines of several joints from Python, and the check of their recordings."""

import doctest
import json
from pathlib import Path

import numpy as np
import pytest
from legged import MODELS
from typer.testing import CliRunner

import rhythmid as rh
from rhythmid.body import joint_run
from rhythmid.body.machine import Machine
from rhythmid.cli import app

ABOUT = {"type": "chirp", "amplitude": 0.3, "band": [0.5, 5.0], "sweep": 4.0}
EXPERIMENT = {
    "duration": 4.0,
    "namespace": "/leg",
    "start": {"rail": 0.45},
    "excitation": {"hip": {"offset": 0.6, **ABOUT}, "knee": {"offset": -1.2, **ABOUT, "band": [0.5, 6.0]}},
}
SIGNALS = MODELS / "leg_signals.yaml"


@pytest.fixture(scope="module")
def run():
    return rh.simulate(rh.Model.load(MODELS / "leg.yaml"), EXPERIMENT)


@pytest.fixture(scope="module")
def bag(run, tmp_path_factory: pytest.TempPathFactory) -> Path:
    return run.save(tmp_path_factory.mktemp("run") / "bag")


def test_the_examples_of_the_docstrings_run():
    outcome = doctest.testmod(joint_run)
    assert outcome.attempted > 0 and outcome.failed == 0


def test_a_run_is_the_record_that_is_loaded_from_its_bag(run, bag: Path):
    loaded, made = rh.load(bag, signals=SIGNALS), run.record
    assert loaded.sampled == made.sampled == "mean" and loaded.taken == made.taken
    for joint, one in made.every.items():
        for role, channel in one.channels.items():
            np.testing.assert_allclose(loaded.every[joint].channels[role].value, channel.value)


@pytest.mark.long  # test_cli_legs diagnoses the same leg by the command
def test_a_model_with_a_body_is_diagnosed_by_the_function_for_one_axis(bag: Path):
    leg = rh.Model.load(MODELS / "leg.yaml")
    assert isinstance(leg, Machine)
    answer = rh.diagnose(rh.load(bag, signals=SIGNALS), leg)
    assert answer.to_dict()["verdict"] == "consistent" and answer.headline in answer.summary(200)
    assert [row["joint"] for row in answer.tables()["joints"]] == ["hip", "knee"]


def test_what_does_not_go_together_is_told(run, bag: Path):
    record, leg = rh.load(bag, signals=SIGNALS), rh.Model.load(MODELS / "leg.yaml")
    with pytest.raises(rh.InputError, match="of several joints: give a model with a body"):
        rh.identify(record, rh.paper_hopper())
    with pytest.raises(rh.InputError, match="of several joints: give a model with a body"):
        rh.diagnose(record, rh.paper_hopper())
    with pytest.raises(rh.InputError, match="for a machine of one axis"):
        rh.identify(record, leg, method="paper")


def test_the_channels_of_all_joints_are_checked(bag: Path):
    done = CliRunner().invoke(app, ["check", str(bag), "--signals", str(SIGNALS), "--json", "-"])
    assert done.exit_code == 0, done.output
    found = json.loads(done.stdout)
    roles = {f"{joint}.{role}" for joint in ("hip", "knee") for role in ("input", "output", "effort")}
    assert set(found["channels"]) == {*roles, "base.output"} and found["usable"]


def test_a_joint_that_was_not_recorded_is_a_problem_of_the_recording(bag: Path, tmp_path: Path):
    (tmp_path / "signals.yaml").write_text(SIGNALS.read_text().replace("[hip, knee]", "[hip, ankle]"))
    done = CliRunner().invoke(app, ["check", str(bag), "--signals", str(tmp_path / "signals.yaml")])
    assert isinstance(done.exception, rh.InputError) and "ankle" in str(done.exception)
