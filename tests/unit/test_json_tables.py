"""Tables in JSON: lines, lists of objects, and lists by name are read as columns; what is damaged gets one line."""

import gzip
import json

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rhythmid.errors import InputError
from rhythmid.record.inventory import inventory
from rhythmid.record.table import Table

TIME = np.round(0.01 * np.arange(60), 3)
Q = np.round(np.sin(5.0 * TIME), 6)
ROWS = [{"t": t, "state": {"q": q, "dq": [5.0 * q, 1]}, "mode": "run"} for t, q in zip(TIME, Q, strict=True)]
LINES = "\n".join(json.dumps(row) for row in ROWS)
BY_NAME = {"t": TIME.tolist(), "state": {"q": Q.tolist(), "dq": [[5.0 * q, 1] for q in Q]}}
BY_NUMBER = {
    "t": dict(enumerate(TIME.tolist())),
    "state": {"q": dict(enumerate(Q.tolist()))},
}  # as pandas writes it


@pytest.mark.parametrize(
    ("name", "written"),
    [
        ("run.jsonl", LINES),
        ("run.ndjson", f"{LINES}\n"),
        ("run.json", LINES),
        ("run.json", json.dumps(ROWS)),
        ("run.json", json.dumps(ROWS, indent=2)),
        ("run.json", json.dumps(BY_NAME | {"mass": 0.5})),
        ("run.json", json.dumps(BY_NUMBER)),
    ],
)
def test_the_forms_of_json_give_the_same_columns(tmp_path, name, written):
    (tmp_path / name).write_text(written)
    table = Table.load(tmp_path / name)
    np.testing.assert_array_equal(table.column("t"), TIME)
    np.testing.assert_array_equal(table.column("state.q"), Q)
    if "dq" in written:
        np.testing.assert_array_equal(table.column("state.dq[0]"), 5.0 * Q)


def test_columns_within_a_named_list_are_found_by_the_path_to_them(tmp_path):
    (tmp_path / "run.json").write_text(json.dumps({"mass": 0.5, "entries": ROWS}))
    np.testing.assert_array_equal(Table.load(tmp_path / "run.json").column("entries.state.q"), Q)
    assert next(str(one) for one in inventory(tmp_path / "run.json").recorded) == "entries.state.q"


def test_a_compressed_file_is_read(tmp_path):
    (tmp_path / "run.jsonl.gz").write_bytes(gzip.compress(LINES.encode()))
    np.testing.assert_array_equal(Table.load(tmp_path / "run.jsonl.gz").column("state.q"), Q)


def test_what_a_row_lacks_is_missing(tmp_path):
    rows = [{"t": 0.0, "q": 1.0}, {"t": 0.1, "u": [1.0, 2.0]}, {"t": 0.2, "q": None, "u": [3.0]}]
    (tmp_path / "run.jsonl").write_text("\n".join(map(json.dumps, rows)))
    table = Table.load(tmp_path / "run.jsonl")
    np.testing.assert_array_equal(table.column("q"), [1.0, np.nan, np.nan])
    np.testing.assert_array_equal(table.column("u[1]"), [np.nan, 2.0, np.nan])


def test_a_channel_that_no_row_tells_is_left_out(tmp_path):
    rows = [{"t": t, "q": q if k % 2 else None, "u": None if k % 2 else q, "v": None if k % 2 else "nan"}
            for k, (t, q) in enumerate(zip(TIME, Q, strict=True))]  # fmt: skip
    (tmp_path / "run.jsonl").write_text("\n".join(map(json.dumps, rows)))
    found = inventory(tmp_path / "run.jsonl")
    assert [str(one) for one in found.recorded] == ["q", "u"]
    assert found.left_out == ("v: never changes",)


def test_numbers_and_dates_that_are_written_as_words_are_read(tmp_path):
    rows = [{"time": f"2024-01-05T12:00:0{k}.500Z", "q": f"{k}.25", "mode": "run"} for k in range(5)]
    (tmp_path / "run.jsonl").write_text("\n".join(map(json.dumps, rows)))
    table = Table.load(tmp_path / "run.jsonl")
    np.testing.assert_allclose(np.diff(table.column("time")), 1.0)
    np.testing.assert_array_equal(table.column("q"), np.arange(5) + 0.25)
    assert dict(table.words()) == {"mode": "run"}


def test_a_last_line_that_breaks_off_is_left_out(tmp_path):
    (tmp_path / "run.jsonl").write_text(f'{LINES}\n{{"t": 0.6, "sta')
    assert len(Table.load(tmp_path / "run.jsonl").column("t")) == len(TIME)


@pytest.mark.parametrize(
    ("written", "says"),
    [
        (LINES.replace('"t": 0.02', '"t": 0.02.1'), "line 3 is no JSON"),
        ("", "Expecting value"),
        ('[{"t": 1},', "Expecting"),
        ("[" * 100_000, "recursion"),
    ],
)
def test_what_is_no_json_is_refused_in_one_line(tmp_path, written, says):
    (tmp_path / "run.jsonl").write_text(written)
    with pytest.raises(InputError, match=says) as refused:
        Table.load(tmp_path / "run.jsonl")
    assert "\n" not in str(refused.value)


values = st.recursive(
    st.none() | st.booleans() | st.floats() | st.integers() | st.text(max_size=4),
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.text(max_size=3), inner, max_size=4),
    max_leaves=20,
)


@given(values)
def test_any_json_is_a_table_or_gets_one_line(tmp_path_factory, value):
    path = tmp_path_factory.mktemp("any") / "run.json"
    path.write_text(json.dumps(value))
    try:
        inventory(path)
    except InputError as error:
        assert "\n" not in str(error)
