"""Runs that a file keeps in structs, cells and groups of their own: they are told, and `rhythmid split` takes them apart."""

import json
from pathlib import Path

import foreign
import numpy as np
import pytest
from foreign import moved, tones
from scipy.io import savemat
from typer.testing import CliRunner

from rhythmid.cli import app
from rhythmid.record.grouped_runs import grouped_runs
from rhythmid.record.inventory import inventory
from rhythmid.record.table import Table
from rhythmid.start.start import guess

LENGTHS = (4000, 3000)
TIME = [np.arange(length) * foreign.STEP for length in LENGTHS]
FORCE = [tones(seed, time) for seed, time in enumerate(TIME)]
ANGLE = [moved(force, 0.05, 0.1, 6.0)[0] for force in FORCE]
RUNS = [{"t": t, "q": q, "tau": f} for t, q, f in zip(TIME, ANGLE, FORCE, strict=True)]


def struct_array(path: Path) -> Path:
    runs = np.empty((1, 2), dtype=[(name, "O") for name in RUNS[0]])
    for number, run in enumerate(RUNS):
        runs[0, number] = tuple(run.values())
    savemat(path, {"runs": runs, "mass": 0.05})
    return path


def cell(path: Path) -> Path:
    runs = np.empty(2, dtype=object)
    runs[:] = RUNS
    savemat(path, {"runs": runs})
    return path


def structs(path: Path) -> Path:
    savemat(path, {f"trial{number}": run for number, run in enumerate(RUNS)})
    return path


def of_matlab_7_3(path: Path) -> Path:
    h5py = pytest.importorskip("h5py")
    with h5py.File(path, "w", userblock_size=512) as file:
        held, runs = file.create_group("#refs#"), file.create_group("runs")
        for name in RUNS[0]:
            field = runs.create_dataset(name, (2, 1), dtype=h5py.ref_dtype)
            for number, run in enumerate(RUNS):
                array = held.create_dataset(f"{name}{number}", data=run[name][None])
                array.attrs["MATLAB_class"] = np.bytes_("double")
                field[number, 0] = array.ref
    path.write_bytes(b"MATLAB 7.3 MAT-file".ljust(512) + path.read_bytes()[512:])
    return path


@pytest.mark.parametrize("write", [struct_array, cell, structs, of_matlab_7_3])
def test_each_run_becomes_a_table_of_its_own(tmp_path, write):
    source = write(tmp_path / "log.mat")
    done = CliRunner().invoke(app, ["split", str(source), "--out", str(tmp_path / "runs")])
    assert done.exit_code == 0, done.output
    for number in range(2):
        table = Table.load(tmp_path / "runs" / f"log_{number}.npz")
        assert set(table.columns) == {"t", "q", "tau"}
        np.testing.assert_array_equal(table.column("q"), ANGLE[number])


def test_init_takes_the_first_run_and_says_how_to_take_the_others(tmp_path):
    found = guess(struct_array(tmp_path / "log.mat"))
    (line,) = [line for line in found.lines() if "runs[0] to runs[1]" in line]
    assert line.startswith("CHECK it holds 2 runs") and f"rhythmid split {tmp_path / 'log.mat'}" in line
    assert "CHECK: it holds 2 runs" in found.signals and "runs[1].q" not in found.signals


def test_joints_that_were_recorded_at_once_are_no_runs(tmp_path):
    joints = {f"joint{number}": {"t": TIME[1], "q": ANGLE[0][:3000] * number} for number in (1, 2)}
    savemat(tmp_path / "log.mat", joints)
    assert grouped_runs(Table.load(tmp_path / "log.mat")) is None
    assert {str(one) for one in inventory(tmp_path / "log.mat").recorded} == {"joint1.q", "joint2.q"}


def test_arrays_in_cells_are_columns(tmp_path):
    cells = np.empty(2, dtype=object)
    cells[:] = [np.ones((20, 3)), np.ones((30, 3))]
    savemat(tmp_path / "log.mat", {"data": cells})
    assert len(Table.load(tmp_path / "log.mat").column("data[1][2]")) == 30


def test_runs_whose_names_are_paths_are_written_into_the_folder(tmp_path):
    arrays = [np.column_stack([t, q]).tolist() for t, q in zip(TIME, ANGLE, strict=True)]
    (tmp_path / "log.json").write_text(json.dumps({"../up/slow": arrays[0], ".. up/slow": arrays[1]}))
    done = CliRunner().invoke(app, ["split", str(tmp_path / "log.json"), "--out", str(tmp_path / "out")])
    assert done.exit_code == 0, done.output
    assert sorted(one.name for one in (tmp_path / "out").iterdir()) == [
        "log_.._up_slow.npz",
        "log_.._up_slow_1.npz",
    ]
    assert sorted(one.name for one in tmp_path.iterdir()) == ["log.json", "out"]
