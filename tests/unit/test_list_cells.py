"""Columns of a text table whose cells hold lists of numbers are arrays, however the lists are written."""

import numpy as np
import pytest

from rhythmid.errors import InputError
from rhythmid.record.broken_lines import unbroken
from rhythmid.record.inventory import inventory
from rhythmid.record.read import read_record
from rhythmid.record.signals import Signals
from rhythmid.record.table import Table

TIME = 0.01 * np.arange(300)
Q = np.column_stack([np.sin(3.0 * TIME), 0.5 * np.cos(2.0 * TIME), np.sin(TIME)])
TEXT = [[f"{value:.6f}" for value in row] for row in Q]

FORMS = {
    "Python": lambda row: f"[{', '.join(row)}]",
    "a tuple": lambda row: f"({', '.join(row)})",
    "NumPy": lambda row: f"[ {'  '.join(row)}]",
    "an array": lambda row: f"array('d', [{', '.join(row)}])",
    "NumPy's repr": lambda row: f"array([{', '.join(row)}], dtype=float32)",
}


def written(form, separator: str = ",", head: str = "type,t,q") -> str:
    rows = [
        separator.join(["STATE", f"{t:.2f}", f'"{FORMS[form](row)}"'])
        for t, row in zip(TIME, TEXT, strict=True)
    ]
    return "\n".join([head.replace(",", separator), *rows]) + "\n"


@pytest.mark.parametrize("separator", [",", ";", "\t", " "])
@pytest.mark.parametrize("form", FORMS)
def test_a_list_in_each_row_is_an_array(tmp_path, form, separator):
    (tmp_path / "run.csv").write_text(written(form, separator))
    table = Table.load(tmp_path / "run.csv")
    assert list(table.columns) == ["type", "t", "q"]
    np.testing.assert_allclose(table.columns["q"], Q, atol=1e-6)
    np.testing.assert_allclose(table.column("t"), TIME, atol=1e-9)
    assert [str(one) for one in inventory(tmp_path / "run.csv").recorded] == ["q[0]", "q[1]", "q[2]"]


def test_its_columns_are_channels(tmp_path):
    (tmp_path / "run.csv").write_text(written("Python"))
    text = "time: {column: t}\ninput: none\noutput: {column: 'q[1]'}\n"
    record = read_record(tmp_path / "run.csv", Signals.from_text(text))
    np.testing.assert_allclose(record.output.value, Q[:, 1], atol=1e-6)


def test_whole_numbers_in_lists_are_no_decimal_commas(tmp_path):
    (tmp_path / "run.csv").write_text("".join(f'{k},"[{k}, {k + 1}, {k + 2}, 7]"\n' for k in range(9)))
    table = Table.load(tmp_path / "run.csv")
    np.testing.assert_array_equal(table.column("1[2]"), np.arange(9) + 2.0)


@pytest.mark.parametrize("empty", ["", '""', "nan", '"[]"'])
def test_an_empty_cell_is_a_list_of_missing_values(tmp_path, empty):
    (tmp_path / "run.csv").write_text(f't,q\n0,{empty}\n1,"[1, 2]"\n2,"[3, None]"\n')
    found = Table.load(tmp_path / "run.csv").columns["q"]
    np.testing.assert_array_equal(found, [[np.nan, np.nan], [1.0, 2.0], [3.0, np.nan]])


@pytest.mark.parametrize(
    ("cell", "says"),
    [
        ("[1, 2, 3]", r"line 4 \(.*\) holds a list of 3 in column 2, the first holds 2"),
        ("1, 2]", r"line 4 \(.*\) holds no list of numbers in column 2"),
    ],
)
def test_a_row_with_a_list_of_another_length_is_refused_with_its_number(tmp_path, cell, says):
    (tmp_path / "run.csv").write_text(f't,q\n0,"[1, 2]"\n1,"[1, 2]"\n2,"{cell}"\n3,"[1, 2]"\n')
    with pytest.raises(InputError, match=says) as refused:
        Table.load(tmp_path / "run.csv")
    assert "\n" not in str(refused.value)


@pytest.mark.parametrize("cell", ["[[1, 2], [3, 4]]", "[left, right]", "go (fast)", "[0.1 ... 0.2]", "(3)"])
def test_other_cells_in_brackets_are_words(tmp_path, cell):
    (tmp_path / "run.csv").write_text("t,note\n" + "".join(f'{k},"{cell}"\n' for k in range(5)))
    (left,) = Table.load(tmp_path / "run.csv").words()
    assert left == ("note", cell)


def test_a_line_of_units_in_brackets_is_no_row(tmp_path):
    rows = "".join(f'{k},"[{k}, 2]"\n' for k in range(5))
    (tmp_path / "run.csv").write_text(f"t,q\n[s],[1]\n{rows}")
    assert list(Table.load(tmp_path / "run.csv").columns) == ["t [s]", "q"]


@pytest.mark.parametrize("end", ["\n", "\r\n"])
def test_a_list_that_numpy_has_broken_into_lines_is_whole(tmp_path, end):
    values = np.random.default_rng(0).standard_normal((300, 2, 9))
    rows = [f'{k},"{first}","{second}",7' for k, (first, second) in enumerate(values)]
    assert "\n" in rows[0]
    (tmp_path / "run.csv").write_text("\n".join(["t,q,dq,n", *rows, ""]), newline=end)
    found = Table.load(tmp_path / "run.csv")
    np.testing.assert_allclose(found.columns["q"], values[:, 0], atol=1e-7)
    np.testing.assert_allclose(found.columns["dq"], values[:, 1], atol=1e-7)
    np.testing.assert_array_equal(found.column("n"), 7.0)


def test_lines_behind_a_broken_list_keep_their_numbers(tmp_path):
    (tmp_path / "run.csv").write_text('t,q\n0,"[1\n 2]"\n1,"[1\n 2]"\n2,"[1 2 3]"\n')
    with pytest.raises(InputError, match="line 6 .* holds a list of 3"):
        Table.load(tmp_path / "run.csv")


def test_a_quotation_mark_that_opens_no_list_breaks_nothing():
    lines = ['5" [mm],x\n', *(f"{k},1\n" for k in range(200))]
    assert list(unbroken(lines)) == lines
    opened = ['0,"[1, 2\n', *(f"{k},1\n" for k in range(200))]
    assert list(unbroken(opened)) == opened
