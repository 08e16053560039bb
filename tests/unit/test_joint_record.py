"""Recordings of several joints, from bags and from tables."""

from pathlib import Path

import numpy as np
import pytest

from rhythmid.errors import InputError
from rhythmid.record.bag import Bag
from rhythmid.record.bag_report import quality_report
from rhythmid.record.joint_messages import write_joint_bag
from rhythmid.record.joint_record import JointSignals, load_joint_records
from rhythmid.record.table import Table

BAG = """
joints: [hip, knee]
input:  {topic: /cmd, field: "position[*]", feedforward: "effort[*]"}
output: {topic: /joint_states, field: "position[*]"}
effort: {field: "effort[*]", taken: after_actuator, sampled: instant}
base:   {field: "position[rail]"}
"""
TIME = np.arange(500) * 0.002
MOTION = np.column_stack([np.sin(7.0 * TIME), np.cos(5.0 * TIME), 0.1 * TIME])


def recorded(folder: Path) -> Path:
    stamps = np.round(TIME * 1e9).astype(np.int64) + 1_700_000_000_000_000_000
    joints = ("knee", "hip", "rail")  # another order than the signals name them
    states = {"position": MOTION, "velocity": 2.0 * MOTION, "effort": 3.0 * MOTION}
    command = {"position": MOTION[:, :2] + 0.1, "effort": 0.5 * MOTION[:, :2]}
    topics = {"/joint_states": (stamps, joints, states), "/cmd": (stamps, joints[:2], command)}
    return write_joint_bag(folder / "bag", topics)


def test_every_joint_of_a_bag_has_a_record_of_its_own(tmp_path: Path):
    (tmp_path / "signals.yaml").write_text(BAG)
    (found,) = load_joint_records([recorded(tmp_path)], tmp_path / "signals.yaml")
    assert list(found.joints) == ["hip", "knee"] and found.taken == "after_actuator"
    assert found.sampled == "instant"
    for joint, column in (("hip", 1), ("knee", 0)):
        record = found.joints[joint]
        assert record.input_kind == "reference"
        assert record.input is not None and record.effort is not None and record.forcing is not None
        np.testing.assert_array_equal(record.output.value, MOTION[:, column])
        np.testing.assert_array_equal(record.effort.value, 3.0 * MOTION[:, column])
        np.testing.assert_array_equal(record.input.value, MOTION[:, column] + 0.1)
        np.testing.assert_array_equal(record.forcing.value, 0.5 * MOTION[:, column])
    assert found.base is not None
    np.testing.assert_array_equal(found.base.output.value, MOTION[:, 2])
    assert found.cut(0.1, 0.5).span == pytest.approx((0.1, 0.498))


def test_a_recording_of_several_joints_is_read_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    read: list[str] = []
    table, blocks = Table.load.__func__, Bag.blocks
    monkeypatch.setattr(Table, "load", classmethod(lambda of, path: read.append("table") or table(of, path)))
    monkeypatch.setattr(Bag, "blocks", lambda self, *of: read.append("bag") or blocks(self, *of))
    load_joint_records([recorded(tmp_path)], JointSignals.from_text(BAG))
    np.savetxt(tmp_path / "run.csv", np.column_stack([TIME, MOTION]), delimiter=",")
    text = "joints: [hip, knee]\ntime: {column: 0}\noutput: {column: [1, 2]}\neffort: {column: [2, 1]}\nbase: {column: 3}\n"
    load_joint_records([tmp_path / "run.csv"], JointSignals.from_text(text))
    assert read == ["bag", "table"]


def test_columns_of_tables_go_by_name_or_by_place(tmp_path: Path):
    rows = np.column_stack([TIME, MOTION[:, :2], MOTION[:, :2] + 0.1])
    header = "t,q_hip,q_knee,r_hip,r_knee"
    np.savetxt(tmp_path / "run.csv", rows, delimiter=",", header=header, comments="")
    np.savez(tmp_path / "run.npz", t=TIME, q=MOTION[:, :2], r=MOTION[:, :2] + 0.1)
    for name, (q, r) in {"run.csv": ("q_*", "r_*"), "run.npz": ("q[*]", "r[*]")}.items():
        signals = tmp_path / f"{name}.yaml"
        signals.write_text(
            f'joints: [hip, knee]\ntime: {{column: t}}\ninput: {{column: "{r}", kind: reference}}\noutput: {{column: "{q}"}}\n'
        )
        (found,) = load_joint_records([tmp_path / name], signals)
        np.testing.assert_allclose(found.joints["knee"].output.value, MOTION[:, 1])
        (itself,) = load_joint_records(
            [_with_file(signals, name)], JointSignals.load(_with_file(signals, name))
        )
        np.testing.assert_allclose(itself.joints["hip"].output.value, MOTION[:, 0])


def _with_file(signals: Path, name: str) -> Path:
    whole = signals.with_name(f"whole_{signals.name}")
    whole.write_text(signals.read_text() + f"tables: {{file: {name}}}\n")
    return whole


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (BAG.replace("joints: [hip, knee]", ""), "'joints:' is missing"),
        (BAG.replace("[hip, knee]", "[]"), "names no joint"),
        (BAG.replace("[hip, knee]", "[hip, hip]"), "names a joint twice"),
        (BAG.replace("[hip, knee]", "[hip, ankle]"), "ankle"),
        (BAG.replace("after_actuator", "behind"), "none of before_actuator, after_actuator"),
        ('joints: [hip]\ninput: {topic: /cmd, field: "effort[*]"}\n', "'output:' is missing"),
        (BAG.replace("position[rail]", "position[mast]"), "mast"),
    ],
)
def test_what_is_wrong_in_the_signals_is_told_in_one_line(tmp_path: Path, text: str, said: str):
    (tmp_path / "signals.yaml").write_text(text)
    bag = recorded(tmp_path)
    with pytest.raises(InputError, match=said) as caught:
        load_joint_records([bag], tmp_path / "signals.yaml")
    assert "\n" not in str(caught.value)


def test_a_scale_by_joint_goes_by_the_models_names_where_the_recording_has_others(tmp_path: Path):
    header = "t,q_0,q_1,i_0,i_1"
    rows = np.column_stack([TIME, MOTION[:, :2], MOTION[:, :2]])
    np.savetxt(tmp_path / "run.csv", rows, delimiter=",", header=header, comments="")
    (tmp_path / "signals.yaml").write_text(
        'joints: {hip: "0", knee: "1"}\ntime: {column: t}\noutput: {column: "q_*", scale: {hip: -1}}\n'
        'effort: {column: "i_*", scale: {knee: 7.5}}\n'
    )
    (found,) = load_joint_records([tmp_path / "run.csv"], tmp_path / "signals.yaml")
    for joint, column, position, effort in (("hip", 0, -1.0, 1.0), ("knee", 1, 1.0, 7.5)):
        one = found.joints[joint]
        assert one.effort is not None
        np.testing.assert_allclose(one.output.value, position * MOTION[:, column])
        np.testing.assert_allclose(one.effort.value, effort * MOTION[:, column])


def test_a_list_has_the_column_of_each_joint_and_a_star_in_a_unit_is_no_joint(tmp_path: Path):
    np.savetxt(
        tmp_path / "run.csv", np.column_stack([TIME, MOTION[:, :2], MOTION[:, :2] + 0.1]), delimiter=","
    )
    text = "joints: [hip, knee]\ntime: {column: 0}\noutput: {column: [2, 1]}\neffort: {column: [3, 4], unit: N*m}\n"
    (tmp_path / "signals.yaml").write_text(text)
    (found,) = load_joint_records([tmp_path / "run.csv"], tmp_path / "signals.yaml")
    np.testing.assert_allclose(found.joints["hip"].output.value, MOTION[:, 1], atol=1e-12)
    np.testing.assert_allclose(found.joints["knee"].output.value, MOTION[:, 0], atol=1e-12)
    assert found.joints["knee"].channels["effort"].unit == "N*m"
    with pytest.raises(InputError, match="lists 1 columns of 2 joints; give each joint one"):
        JointSignals.from_text(text.replace("[2, 1]", "[2]"))
    with pytest.raises(
        InputError, match="lists 2 for more than one joint; give each joint a column of its own"
    ):
        JointSignals.from_text(text.replace("[2, 1]", "[2, 2]"))


def test_check_tells_by_joint_what_no_analysis_will_use(tmp_path):
    time = np.round(0.001 * np.arange(4000), 6)
    slow = np.sin(5.0 * (np.arange(4000) // 10 * 0.01))  # the sensor measures every tenth row
    fast = np.cos(3.0 * time)
    fast[:50] = -1e6
    np.savetxt(
        tmp_path / "run.csv",
        np.column_stack([time, slow, fast]),
        delimiter=",",
        header="t,q_hip,q_knee",
        comments="",
    )
    (tmp_path / "signals.yaml").write_text(
        "time: {column: t}\njoints: [hip, knee]\noutput: {column: 'q_*', unit: rad}\n"
    )
    report = quality_report(tmp_path / "run.csv", tmp_path / "signals.yaml")
    hip, knee = (line for line in report.lines() if "output:" in line and "column" in line)
    assert "samples are left out" in hip and "flawless" not in hip
    assert "50 samples hold -1000000" in knee
    notes = "\n".join(report.notes)
    assert "hip: samples of the output that repeat the one before" in notes and "of 4000" in notes
    assert "knee: output: 50 samples hold exactly -1000000" in notes
    assert {one["channel"] for one in report.to_dict()["left_out"]} == {"hip.output"}
