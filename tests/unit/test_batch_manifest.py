"""A manifest becomes tasks; what is wrong with it is told with its line; keys change with what the answers depend on."""

import os

import pytest
from batches import SIGNALS, write_files, write_swing

from rhythmid.batch.manifest import Manifest
from rhythmid.batch.task import tasks_of
from rhythmid.errors import InputError

GOOD = """
command: identify
model: model.yaml
signals: signals.yaml
entries:
  - {bags: "a/*.csv", group: rig A}
  - bags: [b/1.csv, "b/*.csv"]
    group: rig B
    options: {method: paper}
"""


@pytest.fixture
def folder(tmp_path):
    write_files(tmp_path)
    for name in ("a/1", "a/2", "b/1", "b/2"):
        write_swing(tmp_path / f"{name}.csv")
    return tmp_path


def load(folder, text):
    (folder / "batch.yaml").write_text(text)
    return tasks_of(Manifest.load(folder / "batch.yaml"))


def test_every_recording_is_a_task_once_with_what_is_said_above_the_entries(folder):
    tasks = load(folder, GOOD)
    assert [(task.name, task.group, task.options.method) for task in tasks] == [
        ("a/1.csv", "rig A", "joint"), ("a/2.csv", "rig A", "joint"),
        ("b/1.csv · method paper", "rig B", "paper"), ("b/2.csv · method paper", "rig B", "paper"),
    ]  # fmt: skip
    assert len({task.file for task in tasks}) == 4


def test_recordings_are_answered_with_each_model_and_each_joint(folder):
    (folder / "stiff.yaml").write_text((folder / "model.yaml").read_text().replace("220", "300"))
    (folder / "signals.yaml").write_text(SIGNALS.replace("y", '"*"') + "joints: [y, u]\n")
    tasks = load(
        folder,
        "model: [model.yaml, stiff.yaml]\n"
        + GOOD.replace("model: model.yaml\n", "").replace("paper", "joint"),
    )
    assert len(tasks) == 4 * 2 * 2
    assert {task.name for task in tasks[:4]} == {
        "a/1.csv · y · model", "a/1.csv · u · model", "a/1.csv · y · stiff", "a/1.csv · u · stiff",
    }  # fmt: skip
    only = load(folder, "joints: u\n" + GOOD)
    assert [task.joint for task in only] == ["u"] * 4


def test_recordings_can_be_answered_together_and_held_out(folder):
    (task,) = load(
        folder,
        """
command: diagnose
model: model.yaml
signals: signals.yaml
entries:
  - {bags: "*/*.csv", together: true, options: {holdout: "b/*.csv", budget: 30}}
""",
    )
    assert task.name == "a/1.csv + a/2.csv"
    assert [path.parent.name for path in task.holdout] == ["b", "b"]


@pytest.mark.parametrize(
    ("wrong", "written", "told"),
    [
        ("method: paper", "method: papr", "batch.yaml:9: entries[1].options.method: 'papr' is none of joint, paper"),
        ("method:", "methd:", "batch.yaml:9: entries[1].options.methd: unknown key; did you mean 'method'?"),
        ("group: rig B", "grup: x", "batch.yaml:8: entries[1].grup: unknown key; did you mean 'group'?"),
        ("command: identify", "command: fit", "batch.yaml:2: command: 'fit' is none of identify, diagnose, check"),
        ("command: identify\n", "", "batch.yaml:5: entries[0]: 'command:' is missing"),
        ("command: identify\nmodel: model.yaml", "command: diagnose", "batch.yaml:5: entries[0]: 'model:' is missing"),
        ('"a/*.csv"', '"c/*.csv"', "batch.yaml:6: entries[0].bags: 'c/*.csv' matches nothing in"),
        ('"a/*.csv"', "[]", "batch.yaml:6: entries[0].bags: is empty"),
        ("model: model.yaml", "model: none.yaml", "none.yaml: cannot be read: No such file"),
        ("signals: signals.yaml", "signals: model.yaml", "model.yaml:2: inertia: unknown key"),
        ("entries:", "joints: hip\nentries:", "entries[0]: 'joints:' is for signals files with joints"),
        ("{method: paper}", "{method: joint}\n  - {bags: a/1.csv}", "asks for a/1.csv a second time"),
    ],
)  # fmt: skip
def test_what_is_wrong_is_told_with_its_line(folder, wrong, written, told):
    with pytest.raises(InputError) as refused:
        load(folder, GOOD.replace(wrong, written, 1))
    assert told in str(refused.value) and "\n" not in str(refused.value)


def test_a_change_concerns_only_the_answers_that_depend_on_it(folder):
    def changed(text=GOOD):
        after = [task.key for task in load(folder, text)]
        return [name for name, old, new in zip("1234", before, after, strict=True) if old != new]

    before = [task.key for task in load(folder, GOOD)]
    assert changed() == []
    assert changed(GOOD.replace("rig A", "another name")) == []
    assert changed(GOOD.replace("{method: paper}", "{method: joint}")) == ["3", "4"]
    os.utime(folder / "a" / "2.csv", ns=(1, 1))
    assert changed() == ["2"]
    (folder / "model.yaml").write_text((folder / "model.yaml").read_text() + "# remark\n")
    assert changed() == ["1", "2", "3", "4"]


def test_a_table_that_signals_name_counts_as_the_recording(folder):
    (folder / "run.yaml").write_text("tables: {file: a/1.csv}\n" + SIGNALS)
    text = "command: check\nentries: [{bags: run.yaml}]\n"
    (before,) = load(folder, text)
    write_swing(folder / "a" / "1.csv", rate=50.0)
    (after,) = load(folder, text)
    assert before.key != after.key


FOLDERS = """
command: identify
entries:
  - {bags: "a/*.csv", model: %sa/model.yaml%s, signals: a/signals.yaml}
  - {bags: "b/*.csv", model: %sb/model.yaml%s, signals: b/signals.yaml}
"""


def of_two_folders(folder, content, named=""):
    for name in "ab":
        write_files(folder / name)
    (folder / "b" / "model.yaml").write_text((folder / "a" / "model.yaml").read_text() + content)
    marks = (f"{{{named}: ", "}") * 2 if named else ("",) * 4
    return load(folder, FOLDERS % marks)


def test_models_of_equal_file_names_and_other_content_are_not_taken_for_one(folder):
    tasks = of_two_folders(folder, "# another machine\n")
    assert {task.labels for task in tasks} == {("a/model.yaml", "signals"), ("b/model.yaml", "signals")}
    assert tasks[0].name == "a/1.csv · a/model.yaml" and tasks[-1].name == "b/2.csv · b/model.yaml"


def test_files_of_equal_content_or_of_one_given_name_are_taken_for_one(folder):
    assert {task.labels for task in of_two_folders(folder, "")} == {("model", "signals")}
    assert {task.labels for task in of_two_folders(folder, "# other\n", "rig")} == {("rig", "signals")}
