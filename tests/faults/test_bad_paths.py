"""Paths that cannot be read from or written to: one line that says what is wrong, exit code 2, nothing written."""

import errno
import shutil
from importlib.resources import files
from pathlib import Path

import pytest
from refusals import EXPERIMENT, needs_run

from rhythmid import load
from rhythmid.errors import InputError

MODEL = Path(str(files("rhythmid"))) / "models" / "paper_hopper.yaml"
WRITERS = [
    ("check", "bag", "--json"),
    *(("identify", "bag", option) for option in ("--json", "--report", "--save-model", "--save")),
    *(
        ("diagnose", "bag", "--model", str(MODEL), option)
        for option in ("--json", "--report", "--save-model")
    ),
    ("simulate", "hopper.yaml", "--experiment", "experiment.yaml", "--out"),
    ("run", "experiment.yaml", "--out"),
    ("table1", "--json"),
    ("table1", "--out"),
]
TARGETS = {
    "there": "there: exists already",
    "folder": "folder: exists already",
    "/proc/out": "cannot be written to",
    "file/out": "file/out",
    "a" * 250: "cannot be written: a name in it is longer than 246 bytes",
    "none/" + "a" * 250: "cannot be written: a name in it is longer than 246 bytes",
}


@pytest.mark.parametrize("target", TARGETS, ids=lambda target: target[:12])
@pytest.mark.parametrize("writer", WRITERS, ids=lambda words: f"{words[0]} {words[-1]}")
def test_a_result_is_refused_before_any_work_where_it_cannot_be_written(
    writer, target, tmp_path, refused, good_bag
):
    if writer[0] == "run":
        needs_run()
    if "bag" in writer:
        shutil.copytree(good_bag, tmp_path / "bag")
    shutil.copy(MODEL, tmp_path / "hopper.yaml")
    (tmp_path / "experiment.yaml").write_text(EXPERIMENT)
    (tmp_path / "there").write_text("precious")
    (tmp_path / "file").touch()
    (tmp_path / "folder").mkdir()
    before = sorted(tmp_path.rglob("*"))
    assert TARGETS[target] in refused(*writer, target)
    assert sorted(tmp_path.rglob("*")) == before
    assert (tmp_path / "there").read_text() == "precious"


def test_two_results_are_not_written_over_one_another(refused, bag, topics):
    bag(topics)
    line = refused("identify", "bag", "--json", "out", "--report", "./out")
    assert "is named for two results" in line


LONG = "a" * 300  # characters; file systems take names of at most 255 bytes
LONG_SOURCES = [
    ("check", LONG),
    ("identify", LONG),
    ("diagnose", LONG, "--model", str(MODEL)),
    ("diagnose", LONG, "--sim", LONG),
    ("watch", str(MODEL), "--bag", LONG),
    ("recover", LONG, "--out", "out"),
    ("recover", LONG),
    ("convert", LONG, "--out", "out"),
    ("init", LONG),
    ("batch", LONG),
    ("export", LONG, "--to", "csv"),
    ("design", LONG, "--duration", "9", "--band", "0", "7", "--max-effort", "1", "--noise-std", "1", "--output", "out"),
    ("simulate", LONG, "--experiment", "experiment.yaml", "--out", "out"),
    ("simulate", str(MODEL), "--experiment", LONG, "--out", "out"),
    ("check", "bag", "--signals", LONG),
    ("proof", "--out", LONG, "--cases", "1"),
    ("run", LONG),
]  # fmt: skip


@pytest.mark.parametrize("arguments", LONG_SOURCES, ids=lambda words: " ".join(words).replace(LONG, "LONG"))
def test_a_name_that_no_file_can_have_is_refused_with_one_line(arguments, refused, tmp_path):
    if arguments[0] == "run":
        needs_run()
    (tmp_path / "experiment.yaml").write_text(EXPERIMENT)
    line = refused(*arguments)
    assert LONG in line and "File name too long" in line
    assert sorted(tmp_path.iterdir()) == [tmp_path / "experiment.yaml"]


def test_a_recording_that_may_not_be_read_is_refused_with_one_line(refused, tmp_path, monkeypatch):
    def forbidden(path, **_):
        raise PermissionError(errno.EACCES, "Permission denied", str(path))

    monkeypatch.setattr(Path, "exists", forbidden)
    assert refused("identify", "locked/run.mcap") == "locked/run.mcap: Permission denied"


def test_loading_from_a_name_that_no_file_can_have_raises_the_error_of_bad_input():
    with pytest.raises(InputError, match="File name too long"):
        load(LONG)
