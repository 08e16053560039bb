"""Ctrl-C while identify and diagnose work: exit code 130, nothing written, no process left behind."""

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from batches import write_files, write_run

from rhythmid.elements.catalogue import load_catalogue
from rhythmid.errors import InputError
from rhythmid.excitation.sequence import build
from rhythmid.model import Model
from rhythmid.output import write_text
from rhythmid.simulation.signal import zero_order_hold
from rhythmid.simulation.simulate import simulate

NOMINAL = """
inertia: {mass: {value: 1.0, unit: kg, fixed: true}}
force:
  - linear_spring: {stiffness: {value: 220.0, unit: N/m}, rest_length: {value: 0.0, unit: m}}
  - viscous_damper: {damping: {value: 2.5, unit: N*s/m}}
"""
PATIENCE = 300.0  # s
RUNS = 24  # of a batch that is interrupted after the first answer: more than are answered before a busy machine sees it


@pytest.fixture
def folder(tmp_path) -> Path:
    """A table of a mass on a spring with friction, and the files that describe it; what one command leaves is no other's."""
    machine = Model.from_text(NOMINAL).with_element(load_catalogue()["coulomb_friction"], {"force": 0.3})
    time = np.arange(30_000) / 300.0  # long enough for the work to go on when the interrupt comes
    command = build({"type": "multisine", "rms": 3.0, "period": 10.0, "periods": 10, "band": [0.3, 6.0]})(
        time
    )
    output = simulate(machine, time, zero_order_hold(time, command)).output
    output += np.random.default_rng(0).normal(0.0, 2e-5, len(time))
    table = np.column_stack([time, command, output])
    np.savetxt(tmp_path / "log.csv", table, delimiter=",", header="t,u,y", comments="")
    (tmp_path / "model.yaml").write_text(NOMINAL)
    (tmp_path / "signals.yaml").write_text(
        "time: {column: t}\ntables: {file: log.csv}\ninput: {column: u, unit: N, hold: zero}\noutput: {column: y, unit: m}\n"
    )
    return tmp_path


def children(group: int) -> list[int]:
    """Processes of a group that still run."""
    found = []
    for stat in Path("/proc").glob("[0-9]*/stat"):
        try:
            state, _, of = stat.read_text().rpartition(")")[2].split()[:3]
        except OSError:
            continue
        if int(of) == group and state != "Z":
            found.append(int(stat.parent.name))
    return found


@pytest.mark.parametrize(
    ("command", "stage", "to"),
    [("identify", "fitting the model", "process"), ("diagnose", "refitting with", "terminal")],
)
def test_ctrl_c_ends_with_130_and_leaves_neither_files_nor_processes(folder, command, stage, to):
    before = sorted(folder.iterdir())
    arguments = [
        command,
        "signals.yaml",
        "--model",
        "model.yaml",
        "--json",
        "found.json",
        "--report",
        "found.html",
    ]
    if command == "identify":
        arguments += ["--save", "latency.yaml"]
    process = subprocess.Popen(
        [sys.executable, "-m", "rhythmid.cli", *arguments],
        cwd=folder, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True, start_new_session=True,
    )  # fmt: skip
    assert process.stderr is not None
    told: list[str] = []
    assert any(told.append(line) or stage in line for line in process.stderr), told
    time.sleep(0.1)  # into the work that was told
    if to == "terminal":
        os.killpg(process.pid, signal.SIGINT)
    else:
        process.send_signal(signal.SIGINT)
    said = process.stderr.read()
    process.stderr.close()
    assert process.wait(PATIENCE) == 130, said
    assert "Traceback" not in said
    assert sorted(folder.iterdir()) == before
    assert nobody_left(process.pid)


def nobody_left(group: int) -> bool:
    """Whether all processes of a group end."""
    deadline = time.monotonic() + PATIENCE
    while children(group) and time.monotonic() < deadline:
        time.sleep(0.05)
    return not children(group)


def test_ctrl_c_ends_a_batch_with_130_and_its_finished_answers_are_kept(tmp_path):
    write_files(tmp_path)
    for number in range(RUNS):
        write_run(tmp_path / "runs" / f"{number}.csv", number)
    (tmp_path / "batch.yaml").write_text(
        "command: identify\nmodel: model.yaml\nsignals: signals.yaml\nentries: [{bags: 'runs/*.csv'}]\n"
    )
    process = subprocess.Popen(
        [sys.executable, "-m", "rhythmid.cli", "batch", "batch.yaml", "--out", "out", "--jobs", "1"],
        cwd=tmp_path, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True, start_new_session=True,
    )  # fmt: skip
    answers = tmp_path / "out" / "answers"
    deadline = time.monotonic() + PATIENCE
    while not list(answers.glob("[!.]*.json")) and time.monotonic() < deadline:
        time.sleep(0.02)
    os.killpg(process.pid, signal.SIGINT)
    _, said = process.communicate(timeout=PATIENCE)
    assert process.returncode == 130 and "Traceback" not in said
    assert "the same command goes on" in said
    kept = [json.loads(path.read_text())["answer"]["verdict"] for path in answers.glob("*.json")]
    assert 1 <= len(kept) < RUNS and set(kept) == {"identified"}
    assert nobody_left(process.pid)
    assert not (tmp_path / "out" / "index.html").exists()


def test_a_result_that_cannot_be_put_in_its_place_leaves_nothing(tmp_path):
    (tmp_path / "taken").mkdir()
    with pytest.raises(InputError, match="cannot be written"):
        write_text(tmp_path / "taken", "found")
    assert [path.name for path in tmp_path.iterdir()] == ["taken"]


def test_a_campaign_that_is_ended_by_a_signal_leaves_no_worker(tmp_path):
    process = subprocess.Popen(
        [sys.executable, "-m", "rhythmid.cli", "proof", "--kind", "null", "--machine", "decay", "--cases", "2",
         "--out", str(tmp_path / "out")],
        stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True, start_new_session=True,
    )  # fmt: skip
    assert process.stderr is not None
    assert any("sealed" in line for line in process.stderr)
    deadline = time.monotonic() + PATIENCE
    while len(children(process.pid)) < 2 and time.monotonic() < deadline:
        time.sleep(0.02)
    assert len(children(process.pid)) > 1
    process.terminate()
    process.wait(PATIENCE)
    process.stderr.close()
    assert nobody_left(process.pid)
