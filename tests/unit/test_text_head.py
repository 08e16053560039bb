"""Titles, names, units and types above the rows of a text table, in the orders in which programs write them."""

import numpy as np
import pytest

from rhythmid.record.inventory import inventory
from rhythmid.record.table import Table
from rhythmid.record.text_table import read_text

PLAIN = ["Time", "Position", "Torque"]
SI = ["Time [s]", "Position [rad]", "Torque [Nm]"]
ROWS = "".join(f"{0.01 * k:.3f},{0.1 * k:.3f},{k % 7:.1f}\n" for k in range(1, 60))


@pytest.mark.parametrize(
    ("head", "names"),
    [
        ("Time,Position,Torque\n", PLAIN),
        ("Test of Friday\nTime,Position,Torque\n", PLAIN),
        ("Experiment 7,,\nTime,Position,Torque\n", PLAIN),
        ("Left,,Right\nTime,Position,Torque\n", PLAIN),
        ("Time,Position,Torque\n,,\n", PLAIN),
        ("Time,Position,Torque\ns,rad,Nm\n", SI),
        ("Test of Friday\nTime,Position,Torque\ns,rad,Nm\n", SI),
        ("Experiment 7,12,\nTime,Position,Torque\ns,rad,Nm\n", SI),
        ("Motor,Motor,Motor\nTime,Position,Torque\ns,rad,Nm\n", SI),
        ("s,rad,Nm\nTime,Position,Torque\n", SI),
        ("Time,Position,Torque\ndouble,double,double\ns,rad,Nm\n", SI),
        ('"Time","Position","Torque"\n"s","rad","Nm"\n', SI),
        ("# Time,Position,Torque\n# s,rad,Nm\n", SI),
        ("Time,Position,Torque\n(ms),(deg),(V)\n\n", ["Time [ms]", "Position [deg]", "Torque [V]"]),
        ("Time,Position,Torque\n[s],[counts],[%]\n", ["Time [s]", "Position [counts]", "Torque [%]"]),
        ("Time,Position,Torque\ns,rad,Nm/kg\n", ["Time [s]", "Position [rad]", "Torque [Nm/kg]"]),
        ("Time,Position,Torque\ns,1,-\n", ["Time [s]", "Position", "Torque"]),
        ("Name,Position,Torque\nUnit,rad,V\n", ["Name", "Position [rad]", "Torque [V]"]),
        ("Time,Position,Name\nUnits:,V,Units:\n", ["Time", "Position [V]", "Name"]),
        ("Time,Pos,Pos\ns,rad,deg\n", ["Time [s]", "Pos [rad]", "Pos [deg]"]),
    ],
)
def test_names_and_units_are_found_in_the_lines_above_the_rows(tmp_path, head, names):
    (tmp_path / "run.csv").write_text(head + ROWS)
    table = Table.load(tmp_path / "run.csv")
    assert list(table.columns) == names
    assert [table.column(name)[0] for name in names] == [0.01, 0.1, 1.0]


@pytest.mark.parametrize(
    ("head", "names"),
    [
        ("start deg, sample_rate\n90, 1000\n", ["0", "1", "2"]),
        ("start deg, sample_rate\n90, 1000\nTime,Position,Torque\n", PLAIN),
        ("Time,Position,Torque\nstart deg; sample_rate\n90; 1000\n", PLAIN),
        ("Time,Position,Torque\n1000\n", PLAIN),
        ("90, 1000, 5, 7\nTime,Position,Torque\n", PLAIN),
    ],
)
def test_numbers_above_the_rows_that_are_more_or_fewer_than_the_columns_name_nothing(tmp_path, head, names):
    (tmp_path / "run.csv").write_text(head + ROWS)
    table = Table.load(tmp_path / "run.csv")
    assert list(table.columns)[:3] == names
    assert all(len(table.column(name)) == 59 for name in names)


def test_like_files_whose_settings_differ_have_the_same_columns_and_the_rate_that_is_stated_above(tmp_path):
    swing = 40.0 * np.cos(0.02 * np.arange(2000))
    for start in (90, 45):
        text = "".join(f"{value:.2f}\n" for value in swing)
        (tmp_path / f"{start}.txt").write_text(f"start_deg, sample_rate\n{start}, 500 \n{text}")
        found = inventory(tmp_path / f"{start}.txt")
        assert [one.column for one in found.recorded] == ["0"] and found.clock.rate == 500.0


@pytest.mark.parametrize("separator", [";", "\t", " "])
def test_they_are_found_whatever_separates_the_columns(tmp_path, separator):
    head = "Time,Position,Torque\ns,rad,Nm\n"
    (tmp_path / "run.txt").write_text((head + ROWS).replace(",", separator))
    assert list(Table.load(tmp_path / "run.txt").columns) == SI


def test_a_first_row_with_a_cell_that_is_empty_is_a_row(tmp_path):
    (tmp_path / "run.csv").write_text("Time,Position,Torque\n0.000,,\n" + ROWS)
    assert len(Table.load(tmp_path / "run.csv").column("Position")) == 60


@pytest.mark.parametrize("separator", [",", ";", "\t"])
def test_a_separator_behind_every_row_makes_no_column_where_no_line_names_them(tmp_path, separator):
    rows = "".join(separator.join([f"{0.01 * k:.2f}", f"{k * k}", ""]) + "\n" for k in range(9))
    (tmp_path / "run.txt").write_text(rows)
    assert list(read_text(tmp_path / "run.txt")) == ["0", "1"]
    (tmp_path / "run.txt").write_text(f"# t{separator}x\n{rows}")
    assert list(read_text(tmp_path / "run.txt")) == ["t", "x"]


def test_a_last_column_that_is_empty_in_some_rows_is_one(tmp_path):
    (tmp_path / "run.txt").write_text("0\t1\t\n1\t2\t\n2\t3\t7\n")
    np.testing.assert_array_equal(read_text(tmp_path / "run.txt")["2"], [np.nan, np.nan, 7.0])
