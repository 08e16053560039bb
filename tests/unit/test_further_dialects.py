"""Tables as programs write them, of which the names, the units or the time stand elsewhere than above each column: `init` takes the right channels."""

import json
from pathlib import Path

import numpy as np
import pytest
from scipy.io import savemat

from rhythmid.errors import InputError
from rhythmid.record.bag_report import quality_report
from rhythmid.record.inventory import inventory
from rhythmid.record.read import read_record
from rhythmid.record.signals import Signals
from rhythmid.record.table import Table
from rhythmid.start.start import guess

N = 300
TIME = 0.01 * np.arange(N)
ANGLE = 0.3 * np.sin(7.0 * TIME) + 0.1 * np.cos(3.0 * TIME)
TORQUE = np.sin(7.0 * TIME + 0.4) + 0.5 * np.cos(3.0 * TIME)
ROWS = list(zip(TIME.tolist(), ANGLE.tolist(), TORQUE.tolist(), strict=True))


def text(head: str, row) -> str:
    return head + "".join(row(t, q, u) + "\n" for t, q, u in ROWS)


def levels(path: Path) -> None:
    """Columns of several levels, as pandas writes them."""
    head = ",hip,hip\n,position,effort\ntime,,\n"
    path.write_text(text(head, lambda t, q, u: f"{t:.2f},{q:.9f},{u:.9f}"))


def rigid_body(path: Path) -> None:
    """Axes that are named alike below what they are of, as of a motion capture."""
    head = ",Angle,Angle,Torque,Torque\nTime,X,Y,X,Y\n"
    path.write_text(text(head, lambda t, q, u: f"{t:.2f},{q:.9f},0,{u:.9f},0"))


def unit_in_cells(path: Path) -> None:
    path.write_text(text("time,angle,torque\n", lambda t, q, u: f"{t:.2f} s,{q:.9f} rad,{u:.9f} Nm"))


def split_json(path: Path) -> None:
    path.write_text(json.dumps({"columns": ["time", "angle", "torque"], "data": ROWS}))


def dspace(path: Path) -> None:
    channels = np.array([("angle", ANGLE), ("torque", TORQUE)], dtype=[("Name", "O"), ("Data", "O")])
    savemat(path, {"run": {"X": {"Name": "time", "Data": TIME}, "Y": channels}})


def simulink(path: Path) -> None:
    signals = np.array([(ANGLE, "angle"), (TORQUE, "torque")], dtype=[("values", "O"), ("label", "O")])
    savemat(path, {"out": {"time": TIME, "signals": signals}})


def simulator(path: Path) -> None:
    """Arrays with the step beside them, and no time."""
    np.savez(path, dof_pos=ANGLE[:, None], torques=TORQUE[:, None], dt=np.array(0.01))


def recorder(path: Path) -> None:
    np.savez(path, angle=ANGLE, torque=TORQUE, fs=100.0)


FOUND = {
    levels: ("csv", "position", "effort"),
    rigid_body: ("csv", "Angle.X", "Torque.X"),
    unit_in_cells: ("csv", "angle [rad]", "torque [Nm]"),
    split_json: ("json", "angle", "torque"),
    dspace: ("mat", "run.Y[0].angle", "run.Y[1].torque"),
    simulink: ("mat", "out.signals[0].angle", "out.signals[1].torque"),
    simulator: ("npz", "dof_pos", "torques"),
    recorder: ("npz", "angle", "torque"),
}


@pytest.mark.parametrize("write", FOUND, ids=lambda one: one.__name__)
def test_init_finds_the_channels_and_what_it_writes_reads_them(write, tmp_path):
    suffix, output, drives = FOUND[write]
    path = tmp_path / f"run.{suffix}"
    write(path)
    found = guess(path)
    assert {role: str(one.recorded) for role, one in found.roles.choices.items()} == {
        "output": output,
        "input": drives,
    }
    (tmp_path / "signals.yaml").write_text(found.signals)
    assert quality_report(path, tmp_path / "signals.yaml").remarks == []
    record = read_record(path, Signals.load(tmp_path / "signals.yaml"))
    np.testing.assert_allclose(record.output.value, ANGLE, atol=1e-8)
    np.testing.assert_allclose(record.output.time, TIME, atol=1e-9)
    assert record.input is not None
    np.testing.assert_allclose(record.input.value, TORQUE, atol=1e-8)


def test_hexadecimal_numbers_are_numbers(tmp_path):
    (tmp_path / "run.csv").write_text(
        text("time,counts\n", lambda t, q, u: f"{t:.2f},{int(1000 + 500 * q):#06x}")
    )
    np.testing.assert_array_equal(
        Table.load(tmp_path / "run.csv").column("counts"), np.trunc(1000 + 500 * ANGLE)
    )


@pytest.mark.parametrize("across", [False, True])
def test_an_array_in_a_file_of_its_own_has_numbered_columns(across, tmp_path):
    rows = np.column_stack([TIME, ANGLE, TORQUE])
    np.save(tmp_path / "run.npy", rows.T if across else rows)
    np.testing.assert_array_equal(Table.load(tmp_path / "run.npy").column(1), ANGLE)
    assert inventory(tmp_path / "run.npy").clock.column == "0"


def test_an_array_of_another_shape_is_refused_in_one_line(tmp_path):
    np.save(tmp_path / "run.npy", np.zeros((3, 4, 5)))
    with pytest.raises(
        InputError, match=r"its array has the shape \(3, 4, 5\); rows and columns are expected"
    ):
        Table.load(tmp_path / "run.npy")
    (tmp_path / "cut.npy").write_bytes((tmp_path / "run.npy").read_bytes()[:200])
    with pytest.raises(InputError, match="cannot be read as a table"):
        Table.load(tmp_path / "cut.npy")


def test_a_cell_with_a_word_that_is_no_unit_is_a_word(tmp_path):
    (tmp_path / "run.csv").write_text(
        text("time,angle,torque\n", lambda t, q, u: f"{t:.2f},{q:.9f},{u:.6f} bananas")
    )
    assert dict(Table.load(tmp_path / "run.csv").words()).keys() == {"torque"}
