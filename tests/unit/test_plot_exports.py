"""Tables as laboratory programs write them: curves of a plot with times of their own, the rows of a MATLAB matrix, names of
several words, a time without a name."""

import numpy as np
from scipy.io import savemat

from rhythmid.record.inventory import inventory
from rhythmid.record.read import read_record
from rhythmid.record.table import Table
from rhythmid.start.start import start

N = 300
TIME = 0.01 * np.arange(N)
ANGLE, EFFORT = np.sin(3.0 * TIME), np.cos(3.0 * TIME)
NAMES = "/joint_states/position[3]", "/joint_states/effort[6]"


def rqt(shift: float) -> str:
    """Two curves of rqt_plot, the second with stamps that are late by a time [s]."""
    head = ",".join(f'"{name}_{axis}"' for name in NAMES for axis in "xy")
    rows = zip(TIME, ANGLE, TIME + shift, EFFORT)
    return "\n".join([head, *(",".join(f"{cell:.6f}" for cell in row) + "," for row in rows)]) + "\n"


def test_each_curve_of_a_plot_keeps_its_own_times(tmp_path):
    for shift, rows in ((0.0, N), (0.004, 2 * N)):
        path = tmp_path / f"plot{rows}.csv"
        path.write_text(rqt(shift))
        assert len(Table.load(path).columns["time"]) == rows
        signals = tmp_path / "signals.yaml"
        signals.write_text(
            f"time: {{column: time}}\noutput: {{column: '{NAMES[0]}'}}\neffort: {{column: '{NAMES[1]}'}}\n"
        )
        record = read_record(path, signals)
        np.testing.assert_allclose(record.output.value, ANGLE, atol=1e-6)
        assert record.effort is not None
        np.testing.assert_allclose(record.effort.time - record.output.time, shift, atol=1e-9)


def test_curves_of_a_labview_graph_are_named_by_their_plots(tmp_path):
    path = tmp_path / "graph.csv"
    rows = "\n".join(f"{t:.3f};{a:.5f};{t:.3f};{e:.5f}" for t, a, e in zip(TIME, ANGLE, EFFORT))
    path.write_text(f"Time - angle;Amplitude - angle;Time - torque;Amplitude - torque\n{rows}\n")
    assert [one.column for one in inventory(path).recorded] == ["angle", "torque"]


def test_a_place_in_a_plane_is_no_time_and_its_value(tmp_path):
    path = tmp_path / "path.csv"
    rows = "\n".join(f"{x:.5f},{y:.5f}" for x, y in zip(EFFORT, ANGLE))
    path.write_text(f"tip_x,tip_y\n{rows}\n")
    assert list(Table.load(path).columns) == ["tip_x", "tip_y"]


def test_rows_of_a_matrix_are_read_without_its_brackets_and_names_may_have_several_words(tmp_path):
    path = tmp_path / "raw.txt"
    rows = [
        f"{k:6d} {t:8.3f} {1000 * a:14.0f} {e:12.4f}" for k, (t, a, e) in enumerate(zip(TIME, ANGLE, EFFORT))
    ]
    body = ";\n".join(rows).replace("     0", "[    0", 1)
    path.write_text(f" Sample   Time     Encoder 1 Pos   Control Effort\n\n{body}];\n")
    found = inventory(path)
    assert (found.clock.column, [one.column for one in found.recorded]) == (
        "Time",
        ["Encoder 1 Pos", "Control Effort"],
    )
    np.testing.assert_allclose(found.recorded[1].value, EFFORT, atol=1e-4)


def test_a_column_without_a_name_is_the_time_unless_it_counts_the_rows(tmp_path):
    path = tmp_path / "run.csv"
    rows = "\n".join(f"{k + 14};{a:.5f};{t:.3f}" for k, (t, a) in enumerate(zip(TIME, ANGLE)))
    path.write_text(f"Time - Plot 0;Amplitude - Plot 0;\n{rows}\n")
    assert inventory(path).clock.column == ""


def test_a_table_that_is_one_array_without_names_has_its_drive_among_its_columns(tmp_path):
    rng = np.random.default_rng(2)
    duty = np.repeat(rng.uniform(-1.0, 1.0, 30), N // 10)
    speed = np.zeros(len(duty))
    for k in range(1, len(duty)):
        speed[k] = speed[k - 1] + 0.1 * (10.0 * duty[k - 1] - speed[k - 1])
    table = np.column_stack([np.arange(len(duty)), 0.01 * np.cumsum(speed), speed, duty])
    savemat(tmp_path / "motor.mat", {"log": table})
    begun = start([tmp_path / "motor.mat"], rate=100.0)
    roles = {role: choice.recorded.column for role, choice in begun.guess.roles.choices.items()}
    assert roles == {"output": "log[1]", "velocity": "log[2]", "input": "log[3]"}
    assert "log[0]: counts the rows" in begun.guess.inventory.left_out
