"""What an identification of several joints says of itself where it predicts neither motion nor effort."""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from legged import fixed_leg, recorded, references
from rich.console import Console

from rhythmid.body.machine import Machine
from rhythmid.identify.joints.joint_identification import JointEstimate, identify_machine, poor_joints
from rhythmid.record.joint_record import JointRecord
from rhythmid.record.record import Channel

WILD = 1e5  # [rad] a reference that no controller brings a leg to


@pytest.fixture(scope="module")
def leg(tmp_path_factory: pytest.TempPathFactory) -> Machine:
    return Machine.load(fixed_leg(tmp_path_factory.mktemp("leg")))


def swung(machine: Machine) -> JointRecord:
    rng = np.random.default_rng(5)
    time = np.arange(0.0, 6.0, 0.002)
    asked = {"hip": (0.4, 0.3), "knee": (-1.2, 0.3)}
    return recorded(machine, references(asked, time, rng, (0.4, 4.0)), time, rng)


def broken(record: JointRecord, **asked: float) -> JointRecord:
    """The record with the knee's effort exchanged for noise of its size, and references of these amplitudes."""
    rng = np.random.default_rng(6)
    made = {}
    for joint, one in record.joints.items():
        if joint == "knee" and one.effort is not None:
            noise = float(np.std(one.effort.value)) * rng.normal(size=len(one.effort.time))
            one = replace(one, effort=Channel(one.effort.time, noise, one.effort.unit))
        if joint in asked and one.input is not None:
            wave = asked[joint] * rng.normal(size=len(one.input.time))
            one = replace(one, input=Channel(one.input.time, wave, one.input.unit))
        made[joint] = one
    return replace(record, joints=made)


def test_a_fit_that_predicts_neither_motion_nor_effort_of_a_joint_is_not_usable(leg: Machine):
    found = identify_machine([broken(swung(leg), knee=0.5)], leg)
    assert found.not_identified == ("knee",) == tuple(found.to_dict()["quality"]["not_identified"])
    assert not found.usable and found.to_dict()["usable"] is False
    assert found.headline == "Not identified: knee: more than 20 % of the effort and of the motion is missed"
    console = Console(width=300, record=True, file=None, quiet=False)
    with console.capture() as printed:
        found.show(console)
    first, *rest = printed.get().splitlines()
    assert first.startswith(
        "not identified: knee: more than 20 % of the effort and of the motion is missed, so none"
    )
    # the values of the hip can be used
    assert any("parameters; those of knee are not usable" in line for line in rest)
    assert not any("of a fit that is not usable" in line for line in rest)


def test_a_joint_whose_effort_or_motion_is_predicted_is_identified():
    assert poor_joints({"a": 0.1, "b": 0.4, "c": 0.4}, {"a": 9.0, "b": 0.1, "c": 0.3}) == ("c",)
    assert poor_joints({"a": 0.1, "b": 0.4}, None) == ("b",)


def test_a_free_run_that_diverges_is_told_in_one_line_and_mujoco_says_nothing(
    leg: Machine, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
):
    monkeypatch.chdir(tmp_path)
    found = identify_machine([broken(swung(leg), hip=WILD, knee=WILD)], leg)
    (said,) = [note for note in found.notes if "with the identified values" in note]
    assert "the simulation diverges at t = " in said and "\n" not in said
    assert found.free_run["identified"]["knee"] == pytest.approx(10.0)
    assert capfd.readouterr() == ("", "") and not list(tmp_path.iterdir())


def test_a_usable_identification_says_so(leg: Machine):
    found = identify_machine([swung(leg)], leg)
    assert found.usable and found.to_dict()["usable"] is True
    assert not any("diverges" in note for note in found.notes)


def test_an_interval_ends_at_the_bound_of_its_value_and_says_so():
    damping = JointEstimate(0.0, 3.0, "N*m*s/rad", (0.0, math.inf))
    assert damping.at_bound and damping.to_dict()["at_bound"] is True
    assert damping.interval == (0.0, pytest.approx(5.88, abs=0.01))
    free = JointEstimate(1.0, 3.0, "N*m*s/rad", (0.0, math.inf))
    assert not free.at_bound and free.interval[0] == 0.0
    assert JointEstimate(1.0, 3.0, "rad").interval[0] < 0.0
