"""Workbooks are tables: headings, units, dates and empty cells as in text files, other sheets told, bombs and damage refused."""

import datetime
import re
import sys
import zipfile
from pathlib import Path

import numpy as np
import pytest
from openpyxl import Workbook

from rhythmid.errors import InputError
from rhythmid.record import excel_table
from rhythmid.record.inventory import inventory
from rhythmid.record.table import Table

ROWS = [[0.01 * k, round(0.1 * k, 3), k % 7] for k in range(60)]
HEAD = ["Time", "Position", "Torque"]


def workbook(path: Path, *sheets: list[list], corner: tuple[int, int] = (0, 0)) -> Path:
    """A workbook with these sheets; their first cell is `corner` rows down and columns right."""
    book = Workbook()
    book.remove(book.worksheets[0])
    for number, rows in enumerate(sheets):
        sheet = book.create_sheet(f"sheet {number}")
        for _ in range(corner[0]):
            sheet.append([])
        for row in rows:
            sheet.append([None] * corner[1] + list(row))
    book.save(path)
    return path


@pytest.mark.parametrize("corner", [(0, 0), (3, 2)])
@pytest.mark.parametrize(
    ("head", "names"),
    [
        ([HEAD], HEAD),
        ([["Test of Friday"], [], HEAD, ["s", "deg", "Nm"]], ["Time [s]", "Position [deg]", "Torque [Nm]"]),
        ([["start", "rate"], [90, 1000], HEAD], HEAD),
        (
            [["time (s)", 'the "angle" / deg', "tau, motor\n[Nm]"]],
            ["time (s)", "the 'angle' / deg", "tau, motor [Nm]"],
        ),
        ([], ["0", "1", "2"]),
    ],
)
def test_a_sheet_is_read_as_a_text_table_is(tmp_path, head, names, corner):
    table = Table.load(workbook(tmp_path / "run.xlsx", head + ROWS, corner=corner))
    assert list(table.columns)[:3] == names and not table.notes
    np.testing.assert_allclose(np.column_stack([table.column(name) for name in names]), ROWS)


def test_empty_cells_and_errors_are_missing_and_words_are_no_numbers(tmp_path):
    rows = [[*row, "on", True] for row in ROWS]
    rows[5][1] = None
    rows[6][1] = "#DIV/0!"
    rows[7][0] = None
    table = Table.load(workbook(tmp_path / "run.xlsx", [[*HEAD, "State", "Flag"], *rows]))
    assert np.flatnonzero(np.isnan(table.column("Position"))).tolist() == [5, 6]
    assert np.flatnonzero(np.isnan(table.column("Time"))).tolist() == [7]
    assert dict(table.words()) == {"State": "on"} and table.column("Flag").tolist() == [1.0] * 60


@pytest.mark.parametrize(
    "of",
    [
        lambda k: datetime.datetime(2024, 1, 5, 12) + datetime.timedelta(milliseconds=500 * k),
        lambda k: (datetime.datetime(2024, 1, 5, 12) + datetime.timedelta(milliseconds=500 * k)).time(),
        lambda k: datetime.timedelta(milliseconds=500 * k),
    ],
    ids=["date", "time of day", "duration"],
)
def test_dates_times_and_durations_are_seconds(tmp_path, of):
    rows = [[of(k), float(np.sin(k))] for k in range(60)]
    time = Table.load(workbook(tmp_path / "run.xlsx", [["time", "x"], *rows])).column("time")
    np.testing.assert_allclose(time - time[0], 0.5 * np.arange(60), atol=1e-6)


def test_the_first_sheet_with_numbers_is_read_and_the_others_are_told(tmp_path):
    path = workbook(
        tmp_path / "run.xlsx", [["made by", "hand"], ["year", 2024]], [HEAD, *ROWS], [HEAD, *ROWS]
    )
    found = inventory(path)
    assert [one.column for one in found.recorded] == ["Position", "Torque"]
    assert found.notes[0] == "the sheet 'sheet 1' is read, and not 'sheet 0', 'sheet 2'"


def test_a_damaged_workbook_is_refused_in_one_line(tmp_path):
    path = workbook(tmp_path / "run.xlsx", [HEAD, *ROWS])
    whole = path.read_bytes()
    for damaged in (b"", b"PK\x03\x04", whole[: len(whole) // 2], whole[:300] + bytes(600) + whole[900:]):
        path.write_bytes(damaged)
        with pytest.raises(InputError, match=r"run\.xlsx: .*(cannot be read|is empty)") as error:
            Table.load(path)
        assert "\n" not in str(error.value)


def test_a_workbook_of_labview_whose_fills_are_empty_is_read(tmp_path):
    path = workbook(tmp_path / "run.xlsx", [HEAD, *ROWS])
    with zipfile.ZipFile(path) as archive:
        parts = {name: archive.read(name) for name in archive.namelist()}
    parts["xl/styles.xml"] = re.sub(
        rb"<fills.*</fills>", b'<fills count="1"> <fill/></fills>', parts["xl/styles.xml"]
    )
    with zipfile.ZipFile(path, "w") as archive:
        for name, content in parts.items():
            archive.writestr(name, content)
    assert list(Table.load(path).columns) == HEAD


def test_a_zip_of_something_else_is_refused(tmp_path):
    with zipfile.ZipFile(tmp_path / "run.xlsx", "w") as archive:
        archive.writestr("readme", "no workbook")
    with pytest.raises(InputError, match=r"run\.xlsx: cannot be read as a table"):
        Table.load(tmp_path / "run.xlsx")


def test_a_workbook_without_numbers_is_refused(tmp_path):
    with pytest.raises(InputError, match="no sheet holds a table of numbers"):
        Table.load(workbook(tmp_path / "run.xlsx", [["made by", "hand"]]))


@pytest.mark.parametrize("rows", [[HEAD, *ROWS], [HEAD, *ROWS, *([None] * k + [1.0] for k in range(30))]])
def test_a_workbook_that_would_fill_the_memory_is_refused(tmp_path, monkeypatch, rows):
    path = workbook(tmp_path / "run.xlsx", rows)
    monkeypatch.setattr(excel_table, "largest", lambda packed: 1000)
    with pytest.raises(InputError, match="such tables are not read"):
        Table.load(path)
    monkeypatch.setattr(excel_table, "_check_size", lambda path: None)  # an archive that understates its size
    with pytest.raises(InputError, match="such tables are not read"):
        Table.load(workbook(path, [HEAD, *ROWS, *ROWS, *ROWS]))


def test_without_openpyxl_it_is_told_what_to_install(tmp_path, monkeypatch):
    path = workbook(tmp_path / "run.xlsx", [HEAD, *ROWS])
    monkeypatch.setitem(sys.modules, "openpyxl", None)
    with pytest.raises(
        InputError, match=r"run\.xlsx: reading a workbook needs openpyxl: pip install openpyxl"
    ):
        Table.load(path)
