"""A table of several joints that became a bag is the same record."""

import numpy as np
import pytest
from typer.testing import CliRunner

from rhythmid.cli import app
from rhythmid.record.joint_record import load_joint_records

TIME = np.round(0.004 * np.arange(500), 6)
JOINTS = ("yaw", "bend")
SIGNALS = (
    "time: {column: time}\njoints: [yaw, bend]\noutput: {column: 'position_*', unit: rad}\n"
    "input: {column: 'reference_*', unit: rad, kind: reference, hold: zero}\n"
    "effort: {column: 'effort_*', unit: N*m, scale: {bend: -1}, taken: after_actuator, sampled: instant}\n"
)


@pytest.fixture
def table(tmp_path):
    columns = {"time": TIME}
    for number, joint in enumerate(JOINTS):
        columns[f"position_{joint}"] = np.sin((3.0 + number) * TIME) + 0.2 * np.sin(11.0 * TIME)
        columns[f"reference_{joint}"] = np.sin((3.0 + number) * (TIME + 0.02))
        columns[f"effort_{joint}"] = np.cos(2.0 * TIME + number) + 0.1 * np.random.default_rng(number).normal(
            size=len(TIME)
        )
    columns["effort_bend"][7] = np.nan
    np.savetxt(
        tmp_path / "run.csv",
        np.column_stack(list(columns.values())),
        delimiter=",",
        header=",".join(columns),
        comments="",
    )
    (tmp_path / "signals.yaml").write_text(SIGNALS)
    return tmp_path / "run.csv"


def converted(table, *options: str) -> str:
    found = CliRunner().invoke(
        app, ["convert", str(table), "--out", str(table.parent / "bag"), *options], catch_exceptions=False
    )
    assert found.exit_code == 0
    return " ".join(found.output.split())


def test_the_signals_of_all_joints_make_one_topic_of_states_that_reads_back(table):
    own = table.parent / "signals.yaml"
    assert "2 joints (yaw, bend): input, output, effort" in converted(table, "--signals", str(own))
    (given,), (found,) = (
        load_joint_records([table], own),
        load_joint_records([table.parent / "bag"], table.parent / "bag" / "signals.yaml"),
    )
    assert list(found.joints) == list(JOINTS) and (found.taken, found.sampled) == (
        "after_actuator",
        "instant",
    )
    for joint, one in given.joints.items():
        for role, channel in one.channels.items():
            back = found.joints[joint].channels[role]
            np.testing.assert_array_equal(back.value, channel.value)
            np.testing.assert_allclose(back.time, channel.time, rtol=0.0, atol=1e-9)
        assert (found.joints[joint].input_kind, found.joints[joint].hold) == ("reference", "zero")
    assert len(found.joints["bend"].channels["effort"]) == len(TIME) - 1


def test_without_signals_all_joints_that_are_guessed_are_written(table):
    said = converted(table)
    assert "2 joints (bend, yaw)" in said and "yaw: output position_yaw" in said
    (found,) = load_joint_records([table.parent / "bag"], table.parent / "bag" / "signals.yaml")
    assert set(found.joints) == set(JOINTS)


def test_one_joint_is_written_where_its_name_is_given(table):
    assert "joints (" not in converted(table, "--joint", "bend")


def test_one_signals_file_reads_the_bags_of_several_tables(table):
    own = str(table.parent / "signals.yaml")
    again = table.rename(table.parent / "again.csv")
    table.write_bytes(again.read_bytes())
    converted(table, "--signals", own)
    (table.parent / "bag").rename(table.parent / "first")
    converted(again, "--signals", own)
    bags = [table.parent / "first", table.parent / "bag"]
    records = load_joint_records(bags, table.parent / "first" / "signals.yaml")
    assert [len(one.joints) for one in records] == [2, 2]
    units = {one.channels["effort"].unit for record in records for one in record.joints.values()}
    assert units == {"N*m"}
