"""Tables as loggers and oscilloscopes write them: their times, missing values, heads in the middle, and what breaks off."""

import warnings
from datetime import datetime, timedelta
from pathlib import Path

import numpy as np
import pytest
from scipy.io import savemat
from scipy.io.matlab import MatlabOpaque, MatReadWarning

from rhythmid.errors import InputError
from rhythmid.record.inventory import inventory
from rhythmid.record.table import Table

STEP = 0.01
TIME = STEP * np.arange(120)
Q = np.round(np.sin(5.0 * TIME), 5)
TAU = np.round(2.0 * np.cos(5.0 * TIME), 5)
ROWS = [f"{t:.3f},{q:.5f},{tau:.5f}" for t, q, tau in zip(TIME, Q, TAU, strict=True)]
NOON = datetime(2024, 1, 5, 12)
LVM = (
    "LabVIEW Measurement\t\nWriter_Version\t2\nSeparator\tTab\nX_Columns\tOne\nDate\t2024/01/05\n***End_of_Header***\t\n\t\n"
    "Channels\t2\t\t\t\nSamples\t120\t120\t\t\nY_Unit_Label\tVolts\tNewtons\t\t\nX0\t0.0\t0.0\t\t\nDelta_X\t0.01\t0.01\t\t\n"
    "***End_of_Header***\t\t\t\t\nX_Value\tPosition\tForce\tComment\n"
)


def write(
    folder: Path, lines: list[str], head: str = "t,q,tau\n", end: str = "\n", name: str = "run.csv"
) -> Path:
    (folder / name).write_text(head + "\n".join(lines) + end)
    return folder / name


def with_times(folder: Path, times: list[str], head: str = "time;q;tau\n") -> Path:
    return write(folder, [f"{t};{q};{tau}" for t, q, tau in zip(times, Q, TAU, strict=True)], head)


@pytest.mark.parametrize(
    "written",
    [
        [f"{t:.5g} sec" for t in TIME],
        [f"{1e3 * t:.5g} ms" for t in TIME],
        [f"0:{t:06.3f}" for t in TIME],
        [f"12:00:{t:06.3f} PM" for t in TIME],
        [f"1/5/2024 12:00:{t:06.3f} PM" for t in TIME],
        [f"05.01.2024 12:00:{t:06.3f}".replace(".", ",").replace("05,01,", "05.01.") for t in TIME],
        [f"05-Jan-2024 12:00:{t:06.3f}" for t in TIME],
        [f"2024/01/05 12:00:{t:06.3f}" for t in TIME],
        [f"2024-01-05T12:00:{t:012.9f}Z" for t in TIME],
        [f"{45296.5 + t / 86400.0:.10f}" for t in TIME],
        [f"{1704456000000 + round(1e3 * t)}" for t in TIME],
    ],
)
def test_times_in_the_forms_that_programs_use_are_read(tmp_path, written):
    found = inventory(with_times(tmp_path, written))
    assert [str(one) for one in found.recorded] == ["q", "tau"]
    np.testing.assert_allclose(found.recorded[0].time - found.recorded[0].time[0], TIME, atol=2e-5)


def test_a_record_that_crosses_midnight_is_no_month_long_whichever_of_two_numbers_is_the_day(tmp_path):
    late = datetime(2024, 1, 5, 23, 59, 59, 500_000)
    for form in ("%d/%m/%Y %H:%M:%S.%f", "%m/%d/%Y %H:%M:%S.%f"):
        times = [(late + timedelta(seconds=float(t))).strftime(form) for t in TIME]
        found = inventory(with_times(tmp_path, times))
        assert np.ptp(found.recorded[0].time) == pytest.approx(TIME[-1], abs=1e-5)


def test_whole_seconds_and_nanoseconds_are_one_time(tmp_path):
    rows = [
        f"{1704456000 + int(t)},{round(t % 1 * 1e9)},{q},{tau}"
        for t, q, tau in zip(TIME, Q, TAU, strict=True)
    ]
    found = inventory(write(tmp_path, rows, "header.stamp.sec,header.stamp.nanosec,q,tau\n"))
    assert str(found.clock.column) == "header.stamp" and [str(one) for one in found.recorded] == ["q", "tau"]
    np.testing.assert_allclose(found.recorded[0].time, 1704456000 + TIME, atol=1e-6)


@pytest.mark.parametrize(("name", "unit"), [("millis", 1e-3), ("micros", 1e-6)])
def test_a_counter_of_arduino_tells_its_unit(tmp_path, name, unit):
    rows = [f"{100 * k},{q},{tau}" for k, (q, tau) in enumerate(zip(Q, TAU, strict=True))]
    assert inventory(write(tmp_path, rows, f"{name},q,tau\n")).clock.scale == unit


@pytest.mark.parametrize("word", ["N/A", "--", "-nan(ind)", "1.#QNAN", "null", "NaN", ""])
def test_a_word_for_a_missing_value_is_one_and_spoils_no_column(tmp_path, word):
    rows = [row if k % 40 else f"{row.rsplit(',', 1)[0]},{word}" for k, row in enumerate(ROWS)]
    value = Table.load(write(tmp_path, rows)).column("tau")
    np.testing.assert_array_equal(np.flatnonzero(np.isnan(value)), [0, 40, 80])


@pytest.mark.parametrize(
    ("cell", "value"), [("∞", np.inf), ("-∞", -np.inf), ("−0.5", -0.5), ('"5,000.25"', 5000.25)]
)
def test_numbers_in_other_spellings_are_read(tmp_path, cell, value):
    rows = [row if k % 40 != 7 else f"{row.rsplit(',', 1)[0]},{cell}" for k, row in enumerate(ROWS)]
    assert Table.load(write(tmp_path, rows)).column("tau")[7] == value


def test_a_measurement_file_of_labview_is_read_with_its_units(tmp_path):
    rows = [row.replace(",", "\t") + "\t" for row in ROWS]
    source = write(tmp_path, rows, LVM, name="run.lvm")
    assert list(Table.load(source).columns) == [
        "X_Value [s]",
        "Position [Volts]",
        "Force [Newtons]",
        "Comment",
    ]
    found = inventory(source)
    assert [(str(one), one.unit) for one in found.recorded] == [
        ("Position [Volts]", "V"),
        ("Force [Newtons]", "N"),
    ]
    np.testing.assert_allclose(found.recorded[0].time, TIME)


@pytest.mark.parametrize("decimal", [".", ","])
def test_rows_of_labview_without_times_have_those_of_its_head(tmp_path, decimal):
    head = LVM.replace("X_Columns\tOne", "X_Columns\tNo").replace("0.01\t0.01", f"0{decimal}01\t0{decimal}01")
    rows = ["\t" + "\t".join(row.split(",")[1:]).replace(".", decimal) for row in ROWS]
    found = inventory(write(tmp_path, rows, head, name="run.lvm"))
    assert [str(one) for one in found.recorded] == ["Position [Volts]", "Force [Newtons]"]
    np.testing.assert_allclose(found.recorded[0].time, TIME)
    np.testing.assert_allclose(found.recorded[0].value, Q)


def test_a_head_that_stands_in_the_middle_again_is_no_row(tmp_path):
    table = Table.load(write(tmp_path, [*ROWS[:50], "t,q,tau", *ROWS[50:]]))
    np.testing.assert_allclose(table.column("q"), Q)


@pytest.mark.parametrize("head", ["Hello! sensor ok\nStarting...\n", "000,2.1\n", ",2.1\n"])
def test_what_a_logger_prints_before_the_first_row_names_nothing(tmp_path, head):
    table = Table.load(write(tmp_path, ROWS, head))
    assert list(table.columns) == ["0", "1", "2"] and len(table.column(0)) == len(ROWS)


def test_names_may_have_another_separator_than_the_rows(tmp_path):
    assert list(Table.load(write(tmp_path, ROWS, "t q tau\n")).columns) == ["t", "q", "tau"]
    assert list(Table.load(write(tmp_path, ROWS, "t,q,tau\n------\n")).columns) == ["t", "q", "tau"]


@pytest.mark.parametrize("end", ["\n1.20,0.1", "\n" + "\0" * 300])
def test_a_last_line_that_breaks_off_is_left_out(tmp_path, end):
    assert len(Table.load(write(tmp_path, ROWS, end=end)).column("q")) == len(ROWS)


@pytest.mark.parametrize(
    ("line", "words"),
    [
        ("Average,0.1,0.2", "line 122 (Average,0.1,0.2) holds no number in column 1, where 'Average' stands"),
        ("Total rows: 120", "line 122 (Total rows: 120) has 1 cells, the first row has 3"),
    ],
)
def test_a_line_that_is_no_row_is_refused_with_its_number_and_what_to_do(tmp_path, line, words):
    with pytest.raises(InputError) as refused:
        Table.load(write(tmp_path, [*ROWS, line]))
    assert words in str(refused.value) and "delete what does not belong to the table" in str(refused.value)


def test_a_time_that_begins_anew_often_is_refused_with_what_takes_it_apart(tmp_path):
    with pytest.raises(InputError, match=r"'t' begins anew or goes back, first in row 31; .* rhythmid split"):
        inventory(write(tmp_path, ROWS[:30] * 6))


def test_an_object_of_matlab_is_refused_with_what_to_do_there(tmp_path):
    savemat(tmp_path / "run.mat", {"T": "an object"})
    with pytest.raises(InputError, match="holds no column of numbers; .*writetimetable"):
        inventory(tmp_path / "run.mat")


def test_objects_of_matlab_are_refused_by_their_class_and_without_warnings(tmp_path, monkeypatch, capfd):
    kinds = [(name, "O") for name in ("s0", "s1", "s2", "arr")]
    stored = np.array([(b"volts", b"MCOS", b"timeseries", np.zeros(6))], dtype=kinds).view(MatlabOpaque)

    def load(*args, **options):
        warnings.warn("Duplicate variable name", MatReadWarning, stacklevel=1)
        return {"__globals__": [], "mode": "Sine", "None": stored}

    savemat(tmp_path / "run.mat", {"volts": TIME})
    monkeypatch.setattr("scipy.io.loadmat", load)
    with pytest.raises(InputError, match=r"'volts' is an .* class timeseries.*timeseries2timetable\(volts\)"):
        inventory(tmp_path / "run.mat")
    assert capfd.readouterr().err == ""


def test_a_remark_behind_a_row_is_no_part_of_it(tmp_path):
    table = Table.load(write(tmp_path, [*ROWS[:50], f"{ROWS[50]} # touched, by hand", *ROWS[51:]]))
    np.testing.assert_allclose(table.column("tau"), TAU)


@pytest.mark.parametrize(
    ("separator", "above"), [(",", "Header Size: 7\nVersion: 2\n"), (";", ""), ("\t", "")]
)
def test_a_last_column_that_only_some_rows_fill_may_be_missing_in_the_others(tmp_path, separator, above):
    rows = [row.replace(",", separator) for row in ROWS]
    rows[0] += separator + "DAQ Start"
    rows[-1] += separator + "DAQ Pause" + separator + "DAQ Stop"
    path = write(tmp_path, rows, above + separator.join(("t", "q", "tau", "Events")) + "\n", name="run.txt")
    table = Table.load(path)
    np.testing.assert_allclose(table.column("q"), Q)
    np.testing.assert_allclose(table.column("tau"), TAU)


def test_a_separator_after_the_last_name_names_no_column(tmp_path):
    np.testing.assert_allclose(Table.load(write(tmp_path, ROWS, "t,q,tau,\n")).column("tau"), TAU)


def test_a_heading_that_no_row_fills_names_no_columns(tmp_path):
    with pytest.raises(InputError, match="line 1 has 4 columns, the rows have 3"):
        Table.load(write(tmp_path, ROWS, "t,q,tau,Events\n")).column("q")


def test_a_row_of_more_numbers_than_its_heading_is_no_row(tmp_path):
    rows = [*ROWS, "1.2,0.5,0.1,0.3,0.4"]
    rows[0] += ",DAQ Start"
    with pytest.raises(InputError, match="has 5 cells"):
        Table.load(write(tmp_path, rows, "t,q,tau,Events\n")).column("q")
