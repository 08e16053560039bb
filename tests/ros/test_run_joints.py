"""`rhythmid run` with a machine of several joints."""

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import yaml
from patience import LONG, UNHURRIED
from rosbags.rosbag2 import Reader

from rhythmid.body.joint_experiment import JointExperiment, perform
from rhythmid.body.machine import Machine
from rhythmid.identify.joints.joint_identification import identify_machine
from rhythmid.record.joint_record import load_joint_records

LEGS = Path(__file__).parents[2] / "analysis" / "rhythmid" / "models" / "legs"
pytestmark = pytest.mark.timeout(LONG)


def experiment_file(folder: Path, **changes) -> Path:
    """References for a leg in the air, through a delay of its knee's that is no whole number of samples."""
    model = (LEGS / "leg.yaml").read_text().replace("leg.xml", str(LEGS / "leg.xml"))
    knee = model.index("knee:")
    model = model[:knee] + model[knee:].replace("delay: 0.0", "delay: 0.0033")
    (folder / "leg.yaml").write_text(model.replace("contacts: true", "contacts: false"))
    about = {
        "type": "multisine",
        "rms": 0.2,
        "period": 2.0,
        "periods": 2,
        "band": [0.5, 8.0],
        "select": "all",
    }
    content = {
        "model": "leg.yaml",
        "duration": 4.0,
        "rate": 1000,
        "namespace": "/leg",
        "start": {"rail": 0.45},
        "orthogonal": True,
        "excitation": {
            "hip": {"offset": 0.6, "limits": [-0.5, 1.6], **about},
            "knee": {"offset": -1.2, "limits": [-2.0, -0.4], **about},
        },
        "safety": {"stale_after": UNHURRIED},
        "record": {"path": str(folder / "bag")},
        **changes,
    }
    path = folder / "experiment.yaml"
    path.write_text(yaml.safe_dump(content))
    return path


def ran(path: Path) -> tuple[int, str]:
    """Exit code of a run, and what it said."""
    done = subprocess.run(
        [sys.executable, "-m", "rhythmid.cli", "run", str(path)], stderr=subprocess.PIPE, text=True, cwd=path.parent
    )  # fmt: skip
    return done.returncode, done.stderr


def said(bag: Path) -> dict:
    """What `run` said last."""
    with Reader(bag) as reader:
        found = [data for connection, _, data in reader.messages() if connection.topic == "/leg/run"]
    return json.loads(found[-1][8 : 8 + int.from_bytes(found[-1][4:8], "little") - 1])


def test_a_run_in_lockstep_has_the_numbers_of_a_run_without_ros_and_is_identified(tmp_path: Path):
    path = experiment_file(tmp_path)
    code, told = ran(path)
    assert code == 0, told
    experiment, machine = JointExperiment.load(path), Machine.load(tmp_path / "leg.yaml")
    (record,) = load_joint_records([tmp_path / "bag"], LEGS / "leg_signals.yaml")
    expected = perform(machine, experiment).topics
    _, command = expected["/leg/command"]
    joints, states = expected["/leg/joint_states"]
    assert joints == ("hip", "knee", "rail") and said(tmp_path / "bag")["state"] == "finished"
    for place, joint in enumerate(machine.joints):
        one = record.joints[joint]
        np.testing.assert_array_equal(one.input.value, command["position"][:, place])
        np.testing.assert_array_equal(one.output.value, states["position"][:, place])
        np.testing.assert_array_equal(one.effort.value, states["effort"][:, place])
    assert record.base is not None
    np.testing.assert_array_equal(record.base.output.value, states["position"][:, 2])
    found = identify_machine([record], machine).parameters
    assert found["knee.viscous_damper.damping"].value == pytest.approx(0.05, abs=0.005)
    assert found["body.knee.armature"].value == pytest.approx(0.006, abs=0.0005)


def test_a_run_in_real_time_comes_to_its_end_with_a_bag_of_all_joints(tmp_path: Path):
    code, told = ran(
        experiment_file(tmp_path, duration=2.0, time={"mode": "realtime", "layout": "processes"})
    )
    assert code == 0, told
    (record,) = load_joint_records([tmp_path / "bag"], LEGS / "leg_signals.yaml")
    knee = record.joints["knee"]
    assert said(tmp_path / "bag")["state"] == "finished"
    assert len(knee.input.value) > 100 and np.ptp(knee.output.value) > 0.2
    assert -2.0 <= knee.input.value.min() and knee.input.value.max() <= -0.4


def test_a_joint_that_leaves_its_envelope_stops_the_run_and_is_named(tmp_path: Path):
    safety = {"stale_after": UNHURRIED, "joints": {"knee": {"envelope": [-1.25, 0.0]}}}
    code, told = ran(experiment_file(tmp_path, time={"mode": "realtime"}, safety=safety))
    assert code == 1 and "knee: the position" in told and "outside the envelope" in told
    assert "knee" in said(tmp_path / "bag")["reason"]
