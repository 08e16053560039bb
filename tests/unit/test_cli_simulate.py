"""`rhythmid simulate` and what all commands promise: exit codes, one line of refusal, nothing overwritten."""

import os
import shutil
from pathlib import Path

import numpy as np
import pytest
from rosbags.highlevel import AnyReader

import rhythmid as package
from rhythmid.experiment import Experiment
from rhythmid.offline_run import perform

PAPER = Path(package.__file__).parent / "models" / "paper_hopper.yaml"
EXPERIMENT = """\
model: hopper.yaml
excitation: {type: chirp, amplitude: 0.004, sweep: 0.5}
delays: {input: 0.0403, measurement: 0.05}
noise: {measurement_std: 1.0e-5}
"""


@pytest.fixture
def folder(tmp_path) -> Path:
    shutil.copy(PAPER, tmp_path / "hopper.yaml")
    (tmp_path / "run.yaml").write_text(EXPERIMENT, encoding="utf-8")
    return tmp_path


def recorded(bag: Path) -> dict[str, tuple[np.ndarray, np.ndarray]]:
    """Header stamps [ns] and the first field present, by topic, as rosbags itself reads them."""
    found: dict[str, list[tuple[int, float]]] = {}
    with AnyReader([bag]) as reader:
        for connection, _, raw in reader.messages():
            if connection.msgtype != "sensor_msgs/msg/JointState":
                continue
            message = reader.deserialize(raw, connection.msgtype)
            stamp = message.header.stamp.sec * 1_000_000_000 + message.header.stamp.nanosec
            value = message.position[0] if len(message.position) else message.effort[0]
            found.setdefault(connection.topic, []).append((stamp, value))
    return {
        topic: (np.array([stamp for stamp, _ in rows]), np.array([value for _, value in rows]))
        for topic, rows in found.items()
    }


def test_a_bag_is_written_that_holds_the_offline_run(folder, rhythmid):
    done = rhythmid("simulate", "hopper.yaml", "--experiment", "run.yaml", "--out", "bag")
    assert (done.returncode, done.stderr) == (0, "")
    first, note = done.stdout.splitlines()
    assert first == "bag: 500 samples at 1000 Hz of excitation, joint_states, forcing"
    assert note.startswith("note: no forcing is stated, so one of 1 N at 1 Hz acts; ")
    expected = perform(Experiment.load(folder / "run.yaml"))
    found = recorded(folder / "bag")
    assert sorted(found) == ["/hopper/excitation", "/hopper/forcing", "/hopper/joint_states"]
    for topic, (stamps, values) in found.items():
        messages = expected[topic.removeprefix("/hopper/")]
        np.testing.assert_array_equal(stamps, messages.stamp_ns)
        field = messages.effort if messages.position is None else messages.position
        np.testing.assert_array_equal(values, field)


def test_the_truth_is_recorded_only_on_request(folder, command):
    done = command("simulate", "hopper.yaml", "--experiment", "run.yaml", "--out", "bag", "--all-topics")
    assert done.code == 0
    assert {"/hopper/command", "/hopper/plant/joint_states"} <= set(recorded(folder / "bag"))


def test_folders_above_a_result_are_made(folder, command):
    done = command("simulate", "hopper.yaml", "--experiment", "run.yaml", "--out", "out/of/bags/bag")
    assert (done.code, done.err) == (0, "")
    assert recorded(folder / "out" / "of" / "bags" / "bag")
    checks = folder / "out" / "of" / "checks"
    done = command("check", "out/of/bags/bag", "--json", checks / "bag.json", "--report", checks / "bag.html")
    assert done.code == 2 and "less than one period of the forcing" in done.err
    assert {path.name for path in checks.iterdir()} == {"bag.json", "bag.html"}
    page = (checks / "bag.html").read_text(encoding="utf-8")
    assert "<h1>Not usable</h1>" in page and "less than one period of the forcing" in page


def test_a_result_is_never_written_over(folder, command):
    (folder / "bag").mkdir()
    (folder / "bag" / "precious").write_text("data", encoding="utf-8")
    done = command("simulate", "hopper.yaml", "--experiment", "run.yaml", "--out", "bag")
    assert (done.code, done.out) == (2, "")
    assert done.err == "error: bag: exists already; name another file or remove it\n"
    assert [path.name for path in (folder / "bag").iterdir()] == ["precious"]


def test_a_refused_run_leaves_nothing_behind(folder, command):
    (folder / "hopper.yaml").write_text("inertia: {mass: {value: 1000, unit: g}}", encoding="utf-8")
    before = sorted(path.name for path in folder.iterdir())
    done = command("simulate", "hopper.yaml", "--experiment", "run.yaml", "--out", "bag")
    assert done.code == 2
    assert done.err == (
        "error: hopper.yaml:1: inertia.mass: unit 'g' where 'kg' is expected: write the value in kg (multiply it by 0.001)\n"
    )
    assert sorted(path.name for path in folder.iterdir()) == before


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (
            ["simulate", "missing.yaml", "--experiment", "run.yaml", "--out", "bag"],
            "missing.yaml: cannot be read",
        ),
        (
            ["simulate", "hopper.yaml", "--experiment", "missing.yaml", "--out", "bag"],
            "missing.yaml: cannot be read",
        ),
        (["simulate", "hopper.yaml", "--experiment", "run.yaml"], "Missing option"),
        (
            ["simulate", "hopper.yaml", "--experiment", "run.yaml", "--out", "bag", "--elements", "no"],
            "no such folder",
        ),
        (["simulate", "hopper.yaml", "--experiment", "run.yaml", "--oot", "bag"], "No such option"),
        (["simulate"], "Missing"),
        (["simulato"], "No such command 'simulato'"),
    ],
)
def test_bad_usage_is_one_line_and_exit_code_2(arguments, words, folder, refused):
    assert words in refused(*arguments)
    assert not (folder / "bag").exists()


def test_a_place_that_nobody_may_write_is_refused(folder, command):
    done = command("simulate", "hopper.yaml", "--experiment", "run.yaml", "--out", "/proc/bag")
    assert done.code == 2
    assert done.err.startswith("error: /proc/bag: ") and done.err.count("\n") == 1


def test_square_brackets_in_a_message_are_printed_as_they_are(folder, command):
    (folder / "run.yaml").write_text(EXPERIMENT + "safety: {envelope: [1]}\n", encoding="utf-8")
    done = command("simulate", "hopper.yaml", "--experiment", "run.yaml", "--out", "bag")
    assert "two numbers [low, high] are expected" in done.err


def test_help_and_version_are_answers(command):
    assert command("--help").code == 0
    version = command("--version")
    assert (version.code, version.out) == (0, f"rhythmid {package.__version__}\n")


def test_compiled_models_that_cannot_be_kept_are_refused_with_what_to_do(folder, rhythmid):
    (folder / "file").touch()
    done = rhythmid(
        "simulate", "hopper.yaml", "--experiment", "run.yaml", "--out", "bag",
        env={**os.environ, "RHYTHMID_CACHE": str(folder / "file" / "cache")},
    )  # fmt: skip
    assert done.returncode == 2
    assert "set RHYTHMID_CACHE to a writable folder" in done.stderr and done.stderr.count("\n") == 1
