"""A table with several runs one below the other is refused with its time column and the command that splits it; names in a labelled
comment, and symbols with a common subscript, are understood."""

import numpy as np
import pytest

from rhythmid.errors import InputError
from rhythmid.record.inventory import inventory
from rhythmid.record.read import read_record
from rhythmid.record.signals import Signals
from rhythmid.record.split import recordings
from rhythmid.record.table import Table
from rhythmid.record.text_table import read_text
from rhythmid.start.roles import guess_roles

TIME = np.concatenate([100.0 * np.arange(1, 61), 100.0 * np.arange(1, 941)])
VOLTAGE = 6.0 + 3.0 * np.sign(np.sin(TIME / 3000.0)) + 1e-3 * np.cos(TIME / 70.0)


def speed() -> np.ndarray:
    made = np.zeros(len(TIME))
    for k in range(1, len(TIME)):
        made[k] = made[k - 1] + 0.02 * (5.0 * VOLTAGE[k - 1] - made[k - 1])
    return made


def written(path, rows: slice = slice(None)):
    table = np.column_stack([VOLTAGE, speed(), TIME])[rows]
    np.savetxt(path, table, delimiter=",", header="Vr,Wr,time_r", comments="")
    return path


def test_a_time_that_begins_anew_is_named_with_its_row_and_the_command_that_splits_the_table(tmp_path):
    path = written(tmp_path / "log.csv")
    with pytest.raises(
        InputError, match=r"'time_r', begins anew in row 61.*rhythmid split .*log.csv --out runs"
    ):
        inventory(path)
    why, found = recordings(Table.load(path))
    assert "'time_r'" in why and [len(rows) for rows in found.values()] == [60, 940]


def test_a_time_that_goes_back_is_named_where_the_signals_name_it(tmp_path):
    signals = Signals.from_text(
        "time: {column: time_r, scale: 0.001}\ninput: none\noutput: {column: Wr, unit: rad/s, kind: velocity}\n"
    )
    with pytest.raises(InputError, match=r"column Wr \(time: time_r\): time goes backwards"):
        read_record(written(tmp_path / "log.csv"), signals)


def test_of_two_symbols_with_one_subscript_the_voltage_drives_and_the_speed_moves(tmp_path):
    roles = guess_roles(inventory(written(tmp_path / "log.csv", slice(60, None))))
    assert {role: one.recorded.column for role, one in roles.choices.items()} == {
        "output": "Wr",
        "input": "Vr",
    }
    assert roles.output_kind == "velocity"


HEAD = "# Dataset Levitador Magnético\n# Duración: 30.0s\n# Parámetros: k0=0.07, k=0.03, a=0.005, R=2.72\n"


@pytest.mark.parametrize(
    ("line", "names"),
    [
        ("# Columnas: t y y_obs dy_obs i u yd", ["t", "y", "y_obs", "dy_obs", "i", "u", "yd"]),
        ("# Columnas: t, y, y_obs, dy_obs, i, u, yd\n#", ["t", "y", "y_obs", "dy_obs", "i", "u", "yd"]),
        ("# Names of columns:\tt\ty\ty_obs\tdy_obs\ti\tu\tyd", ["t", "y", "y_obs", "dy_obs", "i", "u", "yd"]),
        ("# Gains of loop: 1 2 3 4 5 6 7", list("0123456")),
        ("# Ts: 0.01s", list("0123456")),
    ],
)
def test_names_after_a_label_in_a_comment_are_the_columns(tmp_path, line, names):
    rows = "\n".join("\t".join(f"{0.01 * k + j:.4f}" for j in range(7)) for k in range(30))
    path = tmp_path / "run.txt"
    path.write_bytes(f"{HEAD}{line}\n{rows}\n".encode("latin-1"))
    assert list(read_text(path)) == names
