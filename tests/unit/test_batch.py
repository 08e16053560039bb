"""A batch answers every recording once, keeps what is answered, tells what failed, and shows all of it."""

import csv
import json
import os
import shutil
import signal
from dataclasses import replace
from html.parser import HTMLParser

import numpy as np
import pandas as pd
import pytest
from batches import made_up, write_files, write_run, write_swing
from matplotlib.figure import Figure

import rhythmid as rh
from rhythmid.batch.answered import command_line
from rhythmid.batch.manifest import Manifest
from rhythmid.batch.present import present
from rhythmid.batch.task import tasks_of
from rhythmid.batch.workers import by_cluster
from rhythmid.cli import main
from rhythmid.parallel import fork_each
from rhythmid.report.page import render

CHECK = "command: check\nsignals: signals.yaml\nentries: [{bags: 'runs/*.csv', group: rig A}]\n"
HOSTILE = "<img src=x onerror=alert(1)>.csv"


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """Four swings and one file that cannot be read."""
    monkeypatch.chdir(tmp_path)
    write_files(tmp_path)
    for number in range(4):
        write_swing(tmp_path / "runs" / f"{number}.csv")
    (tmp_path / "runs" / "broken.csv").write_text("t,u,y\n0,1,2\n")
    (tmp_path / "batch.yaml").write_text(CHECK)
    return tmp_path


def stamps(folder):
    """When each kept answer was written."""
    return {path.name: path.stat().st_mtime_ns for path in (folder / "out" / "answers").glob("*.json")}


def test_what_is_answered_is_kept_and_only_what_changed_or_failed_is_answered_anew(folder):
    first = rh.batch("batch.yaml", "out", jobs=2)
    assert len(first.answers) == 5
    ((task, reason),) = first.failures.items()
    assert task.name == "runs/broken.csv" and "too short" in reason
    before = stamps(folder)
    assert len(before) == 4
    write_swing(folder / "runs" / "1.csv", rate=50.0)
    write_swing(folder / "runs" / "broken.csv")
    (folder / "out" / "answers" / next(name for name in before if name.startswith("runs-2"))).write_text("{")
    again = rh.batch("batch.yaml", "out", jobs=1)
    assert not again.failures
    after = stamps(folder)
    kept = sorted(name[:6] for name in before if after[name] == before[name])
    assert kept == ["runs-0", "runs-1", "runs-3"]  # the damaged file of 2 is written again
    assert sorted(name[:6] for name in after if name not in before) == ["runs-1", "runs-b"]


def test_the_table_is_the_same_in_csv_and_parquet_and_has_a_row_with_the_reason_of_a_failure(folder):
    found = rh.batch("batch.yaml", "out", jobs=2)
    with open(folder / "out" / "table.csv", newline="") as file:
        rows = list(csv.DictReader(file))
    table = pd.read_parquet(folder / "out" / "table.parquet")
    assert len(rows) == len(table) == len(found.to_dataframe())
    assert table["value"].dtype == np.float64
    failed = table[table["failure"] != ""]
    assert failed["bag"].tolist() == ["runs/broken.csv"]
    assert np.isnan(failed["value"].to_numpy()).all()
    rates = table[table["name"] == "output.rate"]["value"]
    assert np.allclose(rates, 100.0, rtol=1e-3) and len(rates) == 4


class Links(HTMLParser):
    """Addresses of a page's links."""

    def __init__(self) -> None:
        super().__init__()
        self.found: list[str] = []

    def handle_starttag(self, tag, attrs) -> None:
        self.found += [value or "" for name, value in attrs if tag == "a" and name == "href"]


def test_the_index_leads_to_the_report_of_every_answer(folder):
    rh.batch("batch.yaml", "out", jobs=2)
    links = Links()
    links.feed((folder / "out" / "index.html").read_text())
    reports = [link for link in links.found if not link.startswith("#")]
    assert len(reports) == 4
    for link in reports:
        assert "<h1>" in (folder / "out" / link).read_text()


def test_a_hostile_name_stays_text(folder):
    write_swing(folder / "runs" / HOSTILE)
    rh.batch("batch.yaml", "out", jobs=2)
    page = (folder / "out" / "index.html").read_text()
    assert "<img" not in page and "&lt;img" in page


def test_two_rigs_that_differ_are_told_from_runs_that_agree(tmp_path):
    write_files(tmp_path)
    for number, stiffness in enumerate((220.0, 220.0, 235.0, 235.0)):
        write_run(tmp_path / f"rig{number // 2}" / f"{number}.csv", number, stiffness)
    entries = [{"bags": f"{tmp_path}/rig{rig}/*.csv", "group": f"rig {rig}"} for rig in (0, 1)]
    files = {name: f"{tmp_path}/{name}.yaml" for name in ("model", "signals")}
    found = rh.batch({"command": "identify", **files, "entries": entries}, tmp_path / "out")
    assert not found.failures
    spring = next(one for one in found.agreements if one.name == "linear_spring.stiffness")
    assert spring.different == ("rig to rig",)
    assert spring.groups_p is not None and spring.groups_p < 0.005
    assert "linear spring: stiffness (rig to rig)" in found.headline
    assert "rig to rig" in found.summary(40) and found.plot(Figure().subplots()).get_ylabel()
    row = found.to_dataframe("agreement").set_index("name").loc["viscous_damper.damping"]
    assert row["verdict"] == "agrees" and row["value"] == pytest.approx(2.5, abs=0.05)
    again = rh.identify(rh.load(tmp_path / "rig0" / "0.csv", files["signals"]), rh.Model.load(files["model"]))
    assert spring.runs[0].value == again.parameters["linear_spring.stiffness"].value
    json.dumps(found.to_dict(), allow_nan=False)


def test_recordings_are_diagnosed_with_what_is_held_out(folder):
    for number in (0, 1):
        write_run(folder / "rig" / f"{number}.csv", number)
    options = {"holdout": "rig/1.csv", "budget": 0.001}  # one round of the search
    entry = {"bags": "rig/*.csv", "options": options}
    files = {"model": "model.yaml", "signals": "signals.yaml"}
    found = rh.batch({"command": "diagnose", **files, "entries": [entry]}, "out")
    ((task, answered),) = found.answers
    assert task.name == "rig/0.csv" and answered.verdict == "consistent"
    assert "linear_spring.stiffness" in {one.name for one in answered.values}
    page = (folder / "out" / "index.html").read_text()
    assert "What the diagnoses say" in page


def test_a_drift_is_told_per_day_where_the_clocks_tell(tmp_path):
    noise = np.random.default_rng(0).normal(size=20)
    times = [1.7e9 + 43200.0 * number for number in range(20)]
    found = made_up(tmp_path, [float(2.0 * number + noise[number]) for number in range(20)], times)
    (gain,) = found.agreements
    assert gain.per == "day" and gain.slope is not None
    assert gain.slope.value == pytest.approx(4.0, abs=4.0 * gain.slope.std)
    assert "trend" in gain.different
    assert "N/day" in render(present(found, lambda task: "a.html"))


def test_estimates_without_a_standard_deviation_do_not_count(tmp_path):
    (gain,) = made_up(tmp_path, [1.0, 2.0, None, 3.0], stds=[1.0, 1.0, None, None]).agreements
    assert len(gain.runs) == 2 and gain.left_out == 2
    assert made_up(tmp_path, [1.0] * 4, stds=[0.0] * 4).agreements == ()


def test_a_copy_of_a_recording_under_another_name_is_told_and_counts_once(tmp_path, command):
    write_files(tmp_path)
    for number in range(2):
        write_run(tmp_path / f"{number}.csv", seed=number)
    shutil.copy(tmp_path / "1.csv", tmp_path / "again.csv")
    entries = [{"bags": ["0.csv", "1.csv"], "group": "A"}, {"bags": ["again.csv"], "group": "B"}]
    manifest = {"command": "identify", "model": "model.yaml", "signals": "signals.yaml", "entries": entries}
    (tmp_path / "week.yaml").write_text(json.dumps(manifest))
    said = command("batch", "week.yaml", "--out", "out", "--jobs", "1", "--json", "told.json")
    assert said.code == 0 and "3 answered, 1 of them a copy of another recording" in said.out
    assert "copy: again.csv holds the same samples as 1.csv" in said.out
    told = json.loads((tmp_path / "told.json").read_text())
    assert [one["copy_of"] for one in told["answers"]] == ["", "", "1.csv"]
    assert {one["runs"] for one in told["agreement"] if one["std"]} == {2}
    assert {one["groups"] for one in told["agreement"]} <= {0, 1}
    assert "is a copy of" in (tmp_path / "out" / "index.html").read_text(encoding="utf-8")


def test_a_recording_that_kills_its_process_is_a_failure_and_the_others_are_answered(tmp_path):
    def work(number):
        if number == 2 or (number == 3 and not (tmp_path / "once").exists()):
            (tmp_path / "once").touch()
            os.kill(os.getpid(), signal.SIGKILL)
        if number == 4:
            raise rh.InputError("four is refused")
        return number, os.getpid()

    found = dict(fork_each(work, list(range(12)), 2, lifetime=3))
    assert sorted(found) == list(range(12))
    assert "exit code -9" in str(found[2]) and str(found[4]) == "four is refused"
    rest = {number: one for number, one in found.items() if isinstance(one, tuple)}
    assert sorted(set(found) - set(rest)) == [2, 4]
    assert all(one[0] == number for number, one in rest.items())
    assert len({one[1] for one in rest.values()}) >= 4  # none has answered more than three


def test_matlab_tables_are_read_in_a_batch_too(folder):
    from scipy.io import savemat

    time = np.arange(0.0, 2.0, 0.01)
    savemat(folder / "runs" / "swing.mat", {"t": time, "u": np.ones_like(time), "y": np.cos(5.0 * time)})
    found = rh.batch("batch.yaml", "out", jobs=2)
    assert [task.name for task in found.failures] == ["runs/broken.csv"]


def test_a_cluster_answers_every_recording_once_though_a_worker_is_killed(folder):
    from distributed import LocalCluster

    for number in range(4, 16):
        write_swing(folder / "runs" / f"{number}.csv")
    tasks = tasks_of(Manifest.load("batch.yaml"))
    with LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=":0", silence_logs=50) as cluster:
        answers = by_cluster(tasks, cluster.scheduler_address)
        found = [next(answers)]
        at_work = {worker.address for worker in cluster.scheduler.workers.values() if worker.processing}
        victim = next(one for one in cluster.workers.values() if one.worker_address in at_work)
        os.kill(victim.pid, signal.SIGKILL)
        found += answers
    assert sorted(task.name for task, _ in found) == sorted(task.name for task in tasks)
    assert [task.name for task, one in found if one.failure] == ["runs/broken.csv"]


def test_a_scheduler_that_is_not_there_is_refused_in_one_line(folder, monkeypatch):
    monkeypatch.setattr("rhythmid.batch.workers.CONNECT", "1s")
    with pytest.raises(rh.InputError, match="--scheduler tcp://127.0.0.1:1: no Dask scheduler answers"):
        rh.batch("batch.yaml", "out", scheduler="tcp://127.0.0.1:1")


@pytest.mark.parametrize(
    ("options", "told"),
    [
        ({"jobs": 0}, "--jobs 0: a whole number greater than 0"),
        ({"jobs": 2, "scheduler": "tcp://x:1"}, "give one of them"),
    ],
)
def test_options_that_make_no_sense_are_refused(folder, options, told):
    with pytest.raises(rh.InputError, match=told):
        rh.batch("batch.yaml", "out", **options)
    assert not (folder / "out").exists()


def test_a_folder_with_other_things_in_it_is_not_written_to(folder):
    with pytest.raises(rh.InputError, match="exists already and is no batch's"):
        rh.batch("batch.yaml", "runs")
    assert sorted(path.name for path in (folder / "runs").iterdir())[0] == "0.csv"


def test_the_report_of_an_answer_says_the_command_that_makes_it(folder):
    task = tasks_of(Manifest.load("batch.yaml"))[0]
    named = replace(task, sources=(folder / "a b.csv",))
    assert command_line(named) == f"rhythmid check '{folder}/a b.csv' --signals {folder}/signals.yaml"


def test_the_command_tells_with_its_exit_code_what_became_of_the_batch(folder, monkeypatch, capsys):
    def run(*arguments):
        monkeypatch.setattr("sys.argv", ["rhythmid", "batch", *arguments])
        with pytest.raises(SystemExit) as ended:
            main()
        return ended.value.code, *capsys.readouterr()

    code, out, _ = run("batch.yaml", "--json", "batch.json")
    assert code == 1 and "failed: runs/broken.csv" in out and "batch_batch/index.html" in out
    assert json.loads((folder / "batch.json").read_text())["headline"].startswith("4 of 5 answered")
    (folder / "runs" / "broken.csv").unlink()
    assert run("batch.yaml", "--quiet") == (0, "", "")
    (folder / "batch.yaml").write_text(CHECK.replace("check", "chek"))
    code, _, said = run("batch.yaml")
    assert code == 2 and "batch.yaml:1: command: 'chek' is none of" in said
