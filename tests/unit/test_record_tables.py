"""Tables as records: every kind of file and separator, and one line for every fault."""

import gzip
import os
from datetime import UTC, datetime, timedelta
from pathlib import Path

import numpy as np
import pytest
from scipy.io import savemat

from rhythmid.errors import InputError
from rhythmid.record.bag_report import quality_report
from rhythmid.record.read import load_records, read_record
from rhythmid.record.table import Table

N = 200
TIME = np.arange(N) * 0.002
U, Y = np.sin(7 * TIME), 0.1 * np.cos(7 * TIME)
SIGNALS = "time: {column: t}\ninput: {file: FILE, column: u}\noutput: {file: FILE, column: y}\n"


def text(separator=",", head="t,u,y", rows=None) -> str:
    rows = zip(TIME, U, Y) if rows is None else rows
    lines = [separator.join(f"{value:.17g}" for value in row) for row in rows]
    return "\n".join([head.replace(",", separator)] * bool(head) + lines) + "\n"


def signals(folder: Path, file: str, content: str = SIGNALS) -> Path:
    path = folder / "signals.yaml"
    path.write_text(content.replace("FILE", f"'{file}'"))
    return path


def check(record) -> None:
    np.testing.assert_allclose(record.output.time - record.output.time[0], TIME, atol=1e-12)
    np.testing.assert_allclose(record.output.value, Y, atol=1e-12)
    np.testing.assert_allclose(record.input.value, U, atol=1e-12)


@pytest.mark.parametrize("suffix", [".csv", ".txt", ".dat", ".tsv", ".CSV"])
@pytest.mark.parametrize("separator", [",", ";", "\t", " "])
def test_a_text_table_is_read_whatever_separates_its_columns(tmp_path, suffix, separator):
    (tmp_path / f"run{suffix}").write_text(text(separator))
    check(read_record(signals(tmp_path, f"run{suffix}")))


@pytest.mark.parametrize(
    "content",
    [
        "# recorded on a Friday\n# t,u,y\n" + text(head=""),
        "\ufeff" + text(),
        "\n\n" + text(),
        text().replace("\n", "\r\n"),
        text(head='"t","u","y"'),
        text(head=" t , u , y "),
    ],
    ids=[
        "names in a comment",
        "byte order mark",
        "blank lines",
        "CR LF",
        "quoted names",
        "spaces around names",
    ],
)
def test_the_ways_in_which_programs_write_csv_are_understood(tmp_path, content):
    (tmp_path / "run.csv").write_text(content, encoding="utf-8", newline="")
    check(read_record(signals(tmp_path, "run.csv")))


def test_columns_without_names_are_numbered(tmp_path):
    (tmp_path / "run.csv").write_text(text(head=""))
    numbered = "tables: {file: FILE}\ntime: {column: 0}\ninput: {column: 1}\noutput: {column: 2}\n"
    check(read_record(signals(tmp_path, "run.csv", numbered)))


def test_numpy_and_matlab_files_are_read(tmp_path):
    np.savez(tmp_path / "run.npz", t=TIME, u=U, y=Y)
    savemat(tmp_path / "run.mat", {"t": TIME, "u": U[:, None], "y": Y[None, :]})
    for file in ("run.npz", "run.mat"):
        check(read_record(signals(tmp_path, file)))


@pytest.mark.parametrize("file", ["run.csv.gz", "run.txt.gz", "run.CSV.GZ"])
def test_a_compressed_text_table_is_read_in_place(tmp_path, file):
    (tmp_path / file).write_bytes(gzip.compress(text().encode()))
    check(read_record(signals(tmp_path, file)))
    named = signals(tmp_path, "", COLUMNS)
    (record,) = load_records([tmp_path / file], named)
    check(record)
    assert record.name == "run"


def test_one_column_of_an_array_is_a_signal(tmp_path):
    np.savez(
        tmp_path / "run.npz", t=TIME, y=np.stack([0 * Y, Y], axis=1), u=np.stack([U, 0 * U, 0 * U], axis=1)
    )
    content = SIGNALS.replace("column: u", 'column: "u[0]"').replace("column: y", 'column: "y[1]"')
    check(read_record(signals(tmp_path, "run.npz", content)))


def test_scale_offset_rate_and_use_are_applied(tmp_path):
    np.savez(tmp_path / "run.npz", u=1000 * U, y=100 * Y + 5)
    record = read_record(signals(
        tmp_path, "run.npz",
        "tables: {file: FILE}\ntime: {sample_rate: 500}\ninput: {column: u, scale: 0.001}\n"
        "output: {column: y, scale: 0.01, offset: -0.05}\nuse: [0.1, 0.3]\n",
    ))  # fmt: skip
    used = (TIME > 0.0999) & (TIME < 0.2999)
    np.testing.assert_allclose(record.output.value, Y[used], atol=1e-12)
    np.testing.assert_allclose(record.input.value, U[used], atol=1e-12)
    assert record.hold == "band_limited"


def test_unevenly_spaced_rows_keep_their_times_and_join_by_straight_lines(tmp_path):
    time = TIME + np.random.default_rng(0).uniform(0, 1e-3, N)
    np.savez(tmp_path / "run.npz", t=time, u=U, y=Y)
    record = read_record(signals(tmp_path, "run.npz"))
    np.testing.assert_array_equal(record.output.time, time)
    assert record.hold == "linear"


def test_one_table_is_cut_into_a_seen_and_an_unseen_part(tmp_path):
    np.savez(tmp_path / "run.npz", t=TIME, u=U, y=Y)
    for name, part in (("seen", "[0, 0.3]"), ("unseen", "[0.3, 1]")):
        (tmp_path / f"{name}.yaml").write_text(SIGNALS.replace("FILE", "run.npz") + f"use: {part}\n")
    seen, unseen = load_records([tmp_path / "seen.yaml", tmp_path / "unseen.yaml"])
    np.testing.assert_array_equal(np.concatenate([seen.output.value, unseen.output.value]), Y)


def test_each_column_of_a_table_may_have_a_time_column_of_its_own(tmp_path):
    np.savez(tmp_path / "run.npz", t=TIME, u=U, t2=TIME[::2] + 1e-4, y=Y[::2])
    record = read_record(
        signals(
            tmp_path,
            "run.npz",
            "input: {file: FILE, column: u, time: {column: t}}\noutput: {file: FILE, column: y, time: {column: t2}}\n",
        )
    )
    assert record.input is not None
    np.testing.assert_array_equal(record.input.time, TIME)
    np.testing.assert_array_equal(record.output.time, TIME[::2] + 1e-4)


def test_empty_fields_are_missing_samples_and_are_counted(tmp_path):
    (tmp_path / "run.csv").write_text(text(rows=zip(TIME, U, np.where(np.arange(N) % 50 == 7, np.nan, Y))))
    record = read_record(signals(tmp_path, "run.csv"))
    assert record.quality.channels["output"].nan == N // 50
    np.testing.assert_array_equal(record.output.value, Y[np.arange(N) % 50 != 7])
    assert any("NaN or empty" in line for line in quality_report(signals(tmp_path, "run.csv")).lines())


def test_a_regular_table_with_lost_rows_is_still_band_limited(tmp_path):
    kept = np.delete(np.arange(N), [50, 51, 90])
    np.savez(tmp_path / "run.npz", t=TIME[kept], u=U[kept], y=Y[kept])
    assert read_record(signals(tmp_path, "run.npz")).hold == "band_limited"


@pytest.mark.parametrize(
    "written",
    [
        lambda at: (datetime(2026, 11, 25, 23, 59, 59, 800_000) + timedelta(seconds=at)).isoformat(sep=" "),
        lambda at: (
            datetime(2026, 11, 25, 23, 59, 59, 800_000, tzinfo=UTC) + timedelta(seconds=at)
        ).isoformat(),
        lambda at: (datetime(2026, 11, 25, 23, 59, 59, 800_000) + timedelta(seconds=at)).time().isoformat(),
    ],
    ids=["date", "date with a zone", "time of day past midnight"],
)
def test_dates_and_times_of_day_are_times(tmp_path, written):
    rows = [f"{written(float(at))},{u},{y}" for at, u, y in zip(TIME, U, Y)]
    (tmp_path / "run.csv").write_text("\n".join(["t,u,y", *rows]))
    record = read_record(signals(tmp_path, "run.csv"))
    np.testing.assert_allclose(
        record.output.time - record.output.time[0], TIME, atol=2e-6
    )  # microseconds are written
    np.testing.assert_array_equal(record.output.value, Y)


def test_the_quality_of_a_table_is_reported(tmp_path):
    kept = np.delete(np.arange(N), [50, 51])
    np.savez(tmp_path / "run.npz", t=TIME[kept], u=U[kept], y=Y[kept])
    report = quality_report(signals(tmp_path, "run.npz"))
    assert report.usable and report.channels["output"].timing.lost == 2
    assert any("1 gaps, 2 samples lost" in line for line in report.lines())


POINTER = b"version https://git-lfs.github.com/spec/v1\noid sha256:4d7a\nsize 12345\n"
WRONG = {
    "text in a cell": (text().replace("\n0.0", "\nzero", 1), "run.csv: cannot be read as a table"),
    "mostly NaN": (text(rows=zip(TIME, U, np.where(TIME < TIME[120], np.nan, Y))), "run.csv column y: 120 of 200 samples are NaN"),
    "infinite": (text(rows=[(0, 0, np.inf), *zip(TIME[1:], U[1:], Y[1:])]), "run.csv column y: 1 of 200 samples are infinite"),
    "time is often NaN": (text(rows=zip(np.where(TIME < TIME[5], np.nan, TIME), U, Y)), "time is not finite in row 0"),
    "time goes backwards": (text(rows=zip(TIME[::-1], U, Y)), "time goes backwards"),
    "time stands still": (text(rows=zip(0 * TIME, U, Y)), "all 200 samples have the same time"),
    "rows of unequal length": (text() + "1,2\n", "run.csv: cannot be read as a table"),
    "more names than columns": (text(head="t,u,y,z"), "has 4 columns, the rows have 3"),
    "a name twice": (text(head="t,u,u"), "has no column 'y'; it has t, u, u.1"),
    "other names": (text(head="t,u,yy"), "has no column 'y'; did you mean 'yy'?"),
    "no rows": ("t,u,y\n", "is empty"),
    "no content": ("", "run.csv: is empty"),
    "four rows": (text(rows=list(zip(TIME, U, Y))[:4]), "has only 4 samples: too short"),
    "bytes": ("\0\1\2\3" * 50, "run.csv"),
    "a motionless output": (text(rows=zip(TIME, 0 * U, 0 * Y)), "never changes"),
}  # fmt: skip


@pytest.mark.filterwarnings("ignore:.*input contained no data:UserWarning")
@pytest.mark.parametrize("fault", WRONG)
def test_a_spoilt_text_table_is_refused_with_one_line(tmp_path, fault):
    content, words = WRONG[fault]
    (tmp_path / "run.csv").write_text(content)
    with pytest.raises(InputError) as refused:
        read_record(signals(tmp_path, "run.csv"))
    message = str(refused.value)
    assert "\n" not in message and words in message, message


@pytest.mark.parametrize(
    ("name", "content", "words"),
    [
        *(
            (name, POINTER, "is a pointer of Git LFS, not the data")
            for name in ("run.csv", "run.mat", "run.parquet")
        ),
        ("run.npz", b"", "run.npz: cannot be read as a table"),
        ("run.npz", b"PK\x03\x04 broken", "run.npz: cannot be read as a table"),
        ("run.mat", b"MATLAB 5.0 MAT-file, or not", "run.mat: cannot be read as a table"),
        (
            "run.mat",
            b"MATLAB 7.3 MAT-file" + bytes(105) + b"\x00\x02IM" + bytes(400),
            "run.mat: cannot be read as a table",
        ),
        ("run.h5", b"", "run.h5: cannot be read as a table"),
        ("run.h5", b"\x89HDF\r\n\x1a\n" + bytes(range(256)), "run.h5: cannot be read as a table"),
        ("run.csv.gz", b"t,u,y, but not compressed", "run.csv.gz: cannot be read"),
        ("run.csv.gz", gzip.compress(text().encode())[:400], "run.csv.gz: cannot be read as a table"),
        ("run.gz", gzip.compress(text().encode()), "is not a table"),
        ("run.parquet", b"PAR1", "run.parquet: cannot be read"),
        (
            "run.doc",
            b"PK",
            "is not a table; .mat, .h5, .hdf5, .npz, .npy, .parquet, .xlsx, .xlsm, .json, .jsonl, .ndjson, .csv, .tsv, .txt, .dat, .lvm, .log can be read",
        ),
    ],
)
def test_a_spoilt_or_unknown_file_is_refused_with_one_line(tmp_path, name, content, words):
    (tmp_path / name).write_bytes(content)
    with pytest.raises(InputError) as refused:
        read_record(signals(tmp_path, name))
    assert "\n" not in str(refused.value) and words in str(refused.value), str(refused.value)


def test_a_pickle_within_a_numpy_file_is_not_opened(tmp_path):
    np.savez(tmp_path / "run.npz", t=TIME, u=U, y=np.array([print], dtype=object))
    with pytest.raises(InputError, match="cannot be read as a table"):
        read_record(signals(tmp_path, "run.npz"))


@pytest.mark.parametrize(
    ("columns", "words"),
    [
        ({"t": TIME, "u": U, "y": Y.reshape(20, 10)}, r"has shape \(20, 10\); a vector is expected"),
        ({"t": TIME, "u": U, "y": Y + 1j}, "does not hold real numbers"),
        ({"t": TIME, "u": U, "y": np.array(["a"] * N)}, "does not hold real numbers"),
        ({"t": TIME, "u": U, "y": Y.reshape(20, 10)}, r"such as y\[0\]"),
        ({"t": TIME[:-1], "u": U, "y": Y}, "has 200 rows, its time column 199"),
        ({"t": TIME, "u": U}, "has no column 'y'"),
    ],
)
def test_a_column_that_is_no_signal_is_refused(tmp_path, columns, words):
    np.savez(tmp_path / "run.npz", **columns)
    with pytest.raises(InputError, match=words):
        read_record(signals(tmp_path, "run.npz"))


@pytest.mark.parametrize(
    ("column", "words"),
    [
        ("y[2]", "'y' has 2 columns, counted from 0, but not column 2"),
        ("u[0]", r"column 'u' has shape \(200,\): no columns to choose from"),
        ("x[0]", r"has no column 'x\[0\]'"),
    ],
)
def test_a_column_that_an_array_does_not_have_is_refused(tmp_path, column, words):
    np.savez(tmp_path / "run.npz", t=TIME, u=U, y=np.stack([Y, Y], axis=1))
    content = SIGNALS.replace("column: y", f'column: "{column}"')
    with pytest.raises(InputError, match=words):
        read_record(signals(tmp_path, "run.npz", content))


def test_a_missing_file_and_a_wrong_number_are_refused(tmp_path):
    with pytest.raises(InputError, match=r"none\.csv: no such file"):
        read_record(signals(tmp_path, "none.csv"))
    (tmp_path / "run.csv").write_text(text(head=""))
    with pytest.raises(InputError, match="has 3 columns, counted from 0, but not column 3"):
        Table.load(tmp_path / "run.csv").column(3)


@pytest.mark.parametrize(
    ("content", "words"),
    [
        ("output: {file: FILE, column: y}\n", "'time:' is missing; for a table it is"),
        ("time: header\noutput: {file: FILE, column: y}\n", "a table has no message times"),
        ("time: {sample_rate: 0}\noutput: {file: FILE, column: y}\n", "sample_rate: 0 is too small"),
        ("time: {sample_rate: 500}\noutput: {column: y}\n", "'file:' is missing"),
        ("time: {sample_rate: 500}\noutput: {file: FILE}\n", "give topic and field"),
        ("time: {column: t}\noutput: {file: FILE, column: y, unit: mm}\n", "write  scale: 0.001, unit: m"),
        (
            "time: {column: t}\noutput: {file: FILE, column: y}\ninput: {topic: /u, field: data}\n",
            "cannot be mixed",
        ),
    ],
)
def test_a_wrong_description_is_refused_with_its_line(tmp_path, content, words):
    (tmp_path / "run.csv").write_text(text())
    with pytest.raises(InputError) as refused:
        read_record(signals(tmp_path, "run.csv", content))
    assert "signals.yaml:" in str(refused.value) and words in str(refused.value), str(refused.value)


COLUMNS = "time: {column: t}\ninput: {column: u}\noutput: {column: y}\n"


def test_one_description_serves_many_tables_given_in_place_of_bags(tmp_path):
    named = signals(tmp_path, "", COLUMNS)
    for name in ("small.csv", "large.TXT"):
        (tmp_path / name).write_text(text())
    np.savez(tmp_path / "third.npz", t=TIME, u=U, y=Y)
    found = load_records([tmp_path / name for name in ("small.csv", "large.TXT", "third.npz")], named)
    assert [record.name for record in found] == ["small", "large", "third"]
    for record in found:
        check(record)
    assert quality_report(tmp_path / "small.csv", named).problems == ()


def test_a_channel_may_have_a_file_of_its_own_beside_the_table_that_is_given(tmp_path):
    (tmp_path / "motion.csv").write_text(text(head="t,none,y"))
    (tmp_path / "force.csv").write_text(text())
    own = signals(tmp_path, "force.csv", COLUMNS.replace("{column: u}", "{file: FILE, column: u}"))
    check(read_record(tmp_path / "motion.csv", own))


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (SIGNALS, "names its tables itself"),
        ("output: {topic: /y, field: data}\n", "names topics of a bag, but"),
        (COLUMNS.replace("column: y", "column: z"), "has no column 'z'"),
    ],
)
def test_a_table_and_a_description_that_do_not_belong_together_are_refused(tmp_path, content, words):
    (tmp_path / "run.csv").write_text(text())
    with pytest.raises(InputError, match=words):
        read_record(tmp_path / "run.csv", signals(tmp_path, "run.csv", content))


def test_a_table_without_a_description_is_refused_with_what_to_give(tmp_path):
    (tmp_path / "run.csv").write_text(text())
    with pytest.raises(InputError, match=r"have to be named with --signals"):
        read_record(tmp_path / "run.csv")
    with pytest.raises(InputError, match=r"signals.yaml:2: input: 'file:' is missing"):
        read_record(signals(tmp_path, "", COLUMNS))


SILVERBOX = (
    Path(os.environ.get("RHYTHMID_DATA") or Path(__file__).parents[3] / "shared" / "data") / "silverbox"
)


@pytest.mark.skipif(
    not SILVERBOX.is_dir(), reason=f"the Silverbox data are not in {SILVERBOX}; set RHYTHMID_DATA"
)
def test_a_published_table_is_read_in_place(tmp_path):
    content = "tables: {file: FILE}\ntime: {sample_rate: 610.3515625}\ninput: {column: V1, unit: V}\noutput: {column: V2, unit: V}\n"
    record = read_record(signals(tmp_path, str(SILVERBOX / "SNLS80mV.mat"), content))
    assert len(record.output) > 100_000 and record.hold == "band_limited"
    assert record.quality.gaps == 0 and record.output.period == pytest.approx(2**14 / 1e7, rel=1e-12)
    assert 0.01 < np.std(record.output.value) < 0.2 and np.std(record.input.value) > 0.01


def test_columns_of_one_table_have_one_clock_unless_a_channel_has_times_of_its_own(tmp_path):
    (tmp_path / "run.csv").write_text(text(head="t,u,y,s", rows=zip(TIME, U, Y, TIME)))
    assert read_record(signals(tmp_path, "run.csv")).one_clock
    own = SIGNALS.replace("column: u}", "column: u, time: {column: s}}")
    assert not read_record(signals(tmp_path, "run.csv", own)).one_clock
    (tmp_path / "other.csv").write_text(text())
    other = SIGNALS.replace("{file: FILE, column: u}", "{file: other.csv, column: u}")
    assert not read_record(signals(tmp_path, "run.csv", other)).one_clock


def test_an_array_of_python_objects_is_refused_in_plain_words(tmp_path):
    np.save(tmp_path / "run.npy", np.array({"q": np.zeros(3)}, dtype=object), allow_pickle=True)
    with pytest.raises(InputError, match="holds Python objects, which are code"):
        Table.load(tmp_path / "run.npy")
