"""Text tables in every dialect hold the same numbers; headings tell their units; structs and Parquet are tables, too."""

import math
import sys
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.io import savemat

from rhythmid.errors import InputError
from rhythmid.record.bag_report import quality_report
from rhythmid.record.heading import heading_of
from rhythmid.record.inventory import inventory
from rhythmid.record.read import read_record
from rhythmid.record.signals import Signals
from rhythmid.record.table import Table
from rhythmid.record.text_table import dialect_of, read_text

NUMBERS = st.floats(-1e6, 1e6, allow_subnormal=False)
PREAMBLES = (
    "",
    "# bench 3\n",
    "% made by hand\n%\n",
    "Test run of Friday\n\n",
    "\n\n",
    "# a, b; c\nRobot 7\n",
)


@st.composite
def dialects(draw):
    """Separator, decimal mark, preamble, quotes, units in a line of their own, a trailing separator, line ends."""
    separator = draw(st.sampled_from([",", ";", "\t", " "]))
    decimal = "." if separator == "," else draw(st.sampled_from([".", ","]))
    trailing = separator in ",;" and draw(st.booleans())
    return separator, decimal, draw(st.sampled_from(PREAMBLES)), draw(st.booleans()), draw(st.booleans()), trailing, draw(
        st.sampled_from(["\n", "\r\n"])
    )  # fmt: skip


def written(rows, names, units, dialect) -> str:
    separator, decimal, preamble, quoted, unit_line, trailing, end = dialect

    def line(cells):
        cells = [f'"{cell}"' if quoted else cell for cell in cells]
        return separator.join(cells) + separator * trailing + "\n"

    body = [line([repr(float(value)).replace(".", decimal) for value in row]) for row in rows]
    return (preamble + line(names) + (line(units) if unit_line else "") + "".join(body)).replace("\n", end)


@given(st.lists(st.tuples(NUMBERS, NUMBERS, NUMBERS), min_size=3, max_size=12), dialects())
def test_a_table_reads_the_same_in_every_dialect(tmp_path_factory, rows, dialect):
    path = tmp_path_factory.mktemp("dialect") / "run.csv"
    path.write_text(written(rows, ["t", "angle", "tau"], ["s", "deg", "Nm"], dialect), newline="")
    found = read_text(path)
    names = ["t [s]", "angle [deg]", "tau [Nm]"] if dialect[4] else ["t", "angle", "tau"]
    assert list(found) == names
    np.testing.assert_array_equal(np.column_stack(list(found.values())), np.array(rows))


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16", "cp1252"])
def test_a_degree_sign_is_read_in_every_encoding(tmp_path, encoding):
    (tmp_path / "run.csv").write_text("t [µs];q [°]\n0;1,5\n1;2,5\n2;3\n", encoding=encoding)
    assert list(Table.load(tmp_path / "run.csv").columns) == ["t [µs]", "q [°]"]


def test_a_column_of_words_does_not_hide_the_others(tmp_path):
    (tmp_path / "run.csv").write_text("t,state,q\n0,walk,1\n1,stop,2\n2,walk,3\n")
    table = Table.load(tmp_path / "run.csv")
    np.testing.assert_array_equal(table.column("q"), [1.0, 2.0, 3.0])
    with pytest.raises(InputError, match="'state' does not hold real numbers"):
        table.column("state")


@pytest.mark.parametrize("empty", [",", ", ,", '"",""'])
def test_rows_of_empty_cells_below_a_table_are_no_rows(tmp_path, empty):
    path = tmp_path / "table.csv"
    path.write_text("t,x\n0,1\n1,2\n" + f"{empty}\n" * 300)
    np.testing.assert_array_equal(read_text(path)["x"], [1.0, 2.0])


def test_an_empty_cell_is_no_number_in_any_column(tmp_path):
    (tmp_path / "run.csv").write_text("t;q\n0;1,5\n1;\n2;2,5\n")
    np.testing.assert_array_equal(Table.load(tmp_path / "run.csv").column("q"), [1.5, np.nan, 2.5])


@pytest.mark.parametrize(
    ("heading", "name", "unit", "scale"),
    [
        ("q [rad]", "q", "rad", 1.0),
        ("tau (Nm)", "tau", "N*m", 1.0),
        ("torque [N·m]", "torque", "N*m", 1.0),
        ("pos_deg", "pos", "rad", math.pi / 180),
        ("theta (°)", "theta", "rad", math.pi / 180),
        ("vel_deg_s", "vel", "rad/s", math.pi / 180),
        ("omega [deg/s]", "omega", "rad/s", math.pi / 180),
        ("speed in rpm", "speed", "rad/s", math.pi / 30),
        ("Motor Speed (RPM)", "Motor Speed", "rad/s", math.pi / 30),
        ("speed [rev/min]", "speed", "rad/s", math.pi / 30),
        ("Angle (DEG)", "Angle", "rad", math.pi / 180),
        ("x / mm", "x", "m", 1e-3),
        ("t_ms", "t", "s", 1e-3),
        ("stamp [ns]", "stamp", "s", 1e-9),
        ("a [m/s²]", "a", "m/s^2", 1.0),
        ("pos_a", "pos_a", "", 1.0),
        ("current_a", "current", "A", 1.0),
        ("foot_in", "foot_in", "", 1.0),
        ("yrad", "y", "rad", 1.0),
        ("data.posrad", "data.pos", "rad", 1.0),
        ("motor_thetadeg", "motor_theta", "rad", math.pi / 180),
        ("kneeTiltDeg", "kneeTilt", "rad", math.pi / 180),
        ("sampleTimeMs", "sampleTime", "s", 1e-3),
        ("speedrpm", "speed", "rad/s", math.pi / 30),
        ("grad", "grad", "", 1.0),
        ("thread", "thread", "", 1.0),
        ("rad", "rad", "", 1.0),
        ("yradde", "yradde", "", 1.0),
        ("alarms", "alarms", "", 1.0),
        ("velMa", "velMa", "", 1.0),
        ("xcm", "xcm", "", 1.0),
        ("x [counts]", "x [counts]", "", 1.0),
        ("rpm", "rpm", "rad/s", math.pi / 30),
        ("Rad/s", "Rad/s", "rad/s", 1.0),
        ("Rad/s.Rad/s", "Rad/s", "rad/s", 1.0),
        ("Deg/s", "Deg/s", "rad/s", math.pi / 180),
        ("gyro deg/s", "gyro", "rad/s", math.pi / 180),
        ("and/or", "and/or", "", 1.0),
        ("rpm_left", "left", "rad/s", math.pi / 30),
        ("Target RPM 2", "Target 2", "rad/s", math.pi / 30),
        ("knee.deg.actual", "knee.actual", "rad", math.pi / 180),
        ("degree_of_freedom", "degree_of_freedom", "", 1.0),
        ("data.q", "data.q", "", 1.0),
    ],
)
def test_a_heading_tells_name_unit_and_scale(heading, name, unit, scale):
    found = heading_of(heading)
    assert (found.name, found.unit) == (name, unit)
    assert found.scale == pytest.approx(scale, rel=1e-12)


TIME = np.arange(400) * 0.005
Q, TAU = 0.3 * np.sin(5 * TIME), np.cos(3 * TIME)


def test_check_says_when_a_unit_of_the_heading_is_not_heeded(tmp_path):
    rows = "\n".join(f"{1e3 * t:.1f},{math.degrees(q):.6f},{u:.6f}" for t, q, u in zip(TIME, Q, TAU))
    (tmp_path / "run.csv").write_text(f"t_ms,q [deg],tau [Nm]\n{rows}\n")
    blind = "time: {column: t_ms}\ninput: {column: 'tau [Nm]', unit: N*m}\noutput: {column: 'q [deg]', unit: rad}\n"
    lines = "\n".join(quality_report(tmp_path / "run.csv", Signals.from_text(blind)).lines())
    assert (
        "output: column 'q [deg]' is in deg by its heading, but is read as it is; write  scale: 0.01745329252, unit: rad"
        in lines
    )
    assert "time: column 't_ms' is in ms by its heading" in lines and "write  scale: 0.001" in lines
    assert "tau" not in lines.split("note:", 1)[1]
    heeded = blind.replace("t_ms}", "t_ms, scale: 0.001}").replace(
        "unit: rad", "unit: rad, scale: 0.0174532925"
    )
    assert "note" not in "\n".join(quality_report(tmp_path / "run.csv", Signals.from_text(heeded)).lines())
    record = read_record(tmp_path / "run.csv", Signals.from_text(heeded))
    np.testing.assert_allclose(record.output.time, TIME, atol=1e-9)
    np.testing.assert_allclose(record.output.value, Q, atol=1e-6)


def test_a_clock_that_counts_from_1970_begins_at_the_first_row(tmp_path):
    np.savez(tmp_path / "run.npz", stamp=1.7e9 + TIME, q=Q)
    record = read_record(
        tmp_path / "run.npz", Signals.from_text("time: {column: stamp}\ninput: none\noutput: {column: q}\n")
    )
    np.testing.assert_allclose(record.output.time, TIME, atol=1e-6)


@pytest.mark.parametrize(
    "time",
    [
        "{column: t, sample_rate: 5}",
        "{scale: 0.001}",
        "{sample_rate: 5, scale: 0.1}",
        "{column: t, scale: 0}",
    ],
)
def test_a_time_that_is_said_twice_or_half_is_refused(time):
    with pytest.raises(InputError, match=r"signals.yaml:1: time"):
        Signals.from_text(f"time: {time}\noutput: {{column: q}}\n")


def test_structs_of_matlab_are_read_by_their_paths(tmp_path):
    nested = {
        "data": {"t": TIME, "joint": {"q": Q[:, None]}},
        "runs": np.array([{"u": TAU}, {"u": 2 * TAU}], dtype=object),
    }
    savemat(tmp_path / "run.mat", nested)
    table = Table.load(tmp_path / "run.mat")
    np.testing.assert_allclose(table.column("data.joint.q"), Q)
    np.testing.assert_allclose(table.column("runs[1].u"), 2 * TAU)


def test_parquet_is_read_with_its_times_and_lists(tmp_path):
    pa = pytest.importorskip("pyarrow")
    from pyarrow.parquet import write_table

    stamps = pa.array((1e9 * (1.7e9 + TIME)).astype(np.int64), pa.timestamp("ns"))
    lists = pa.array([[float(q), 0.0] for q in Q])
    write_table(pa.table({"stamp": stamps, "q": lists, "tau": TAU}), tmp_path / "run.parquet")
    text = "time: {column: stamp}\ninput: {column: tau}\noutput: {column: 'q[0]'}\n"
    record = read_record(tmp_path / "run.parquet", Signals.from_text(text))
    np.testing.assert_allclose(record.output.value, Q)
    np.testing.assert_allclose(record.output.time, TIME, atol=1e-6)


def test_lines_of_a_table_without_names_are_its_columns_where_it_is_that_wide(tmp_path):
    np.savetxt(tmp_path / "run.txt", [TIME, Q, TAU])
    np.testing.assert_allclose(Table.load(tmp_path / "run.txt").column("1"), Q)


def test_commas_that_a_spreadsheet_has_appended_are_no_part_of_a_cell(tmp_path):
    rows = [f"{t:.3f};{q:.6f};{u:.6f},," for t, q, u in zip(TIME, Q, TAU)]
    (tmp_path / "run.csv").write_text("\n".join(["Bench 3,,", "t [s];q [rad];tau [Nm],,", *rows]))
    table = Table.load(tmp_path / "run.csv")
    np.testing.assert_allclose(table.column("tau [Nm]"), TAU, atol=1e-6)


def test_a_column_that_a_word_spoils_is_told(tmp_path):
    rows = [f"{t:.3f},{q:.6f},{u:.6f}" for t, q, u in zip(TIME, Q, TAU)]
    rows[0] = "0.0,0.1,-1.2 (was -8.9)"
    (tmp_path / "run.csv").write_text("\n".join(["t,q,tau", *rows]))
    assert inventory(tmp_path / "run.csv").left_out == ("tau: holds words, such as '-1.2 (was -8.9)'",)


def hdf5(path: Path, of_matlab: bool = False) -> Path:
    """A file with a group `robot` of what a robot would record, and much that is no column."""
    import h5py

    with h5py.File(path, "w", userblock_size=512 if of_matlab else 0) as file:
        group = file.create_group("robot")
        for name, values in {"t": TIME, "q": np.column_stack([Q, -Q]), "tau": TAU}.items():
            stored = group.create_dataset(
                name, data=np.atleast_2d(values) if of_matlab and values.ndim == 1 else values.T
            )
            if of_matlab:
                stored.attrs["MATLAB_class"] = np.bytes_("double")
        group.create_dataset("who", data="somebody")
        file.create_dataset("image", data=np.zeros((3, 4, 5)))
        file["elsewhere"] = h5py.ExternalLink("/nowhere.h5", "/x")
        file.create_dataset("secret", (8,), "u1", external=[("/etc/hostname", 0, 8)])
    if of_matlab:
        path.write_bytes(b"MATLAB 7.3 MAT-file".ljust(512) + path.read_bytes()[512:])
    return path


@pytest.mark.parametrize("name", ["run.h5", "run.hdf5"])
def test_hdf5_is_read_by_the_paths_of_its_datasets(tmp_path, name):
    table = Table.load(hdf5(tmp_path / name))
    assert set(table.columns) == {"robot.t", "robot.q", "robot.tau"}  # nothing of another file
    np.testing.assert_array_equal(table.column("robot.q[1]"), -Q)  # it lies across


def test_a_table_of_matlab_7_3_is_read_as_matlab_shows_it(tmp_path):
    table = Table.load(hdf5(tmp_path / "run.mat", of_matlab=True))
    np.testing.assert_array_equal(table.column("robot.t"), TIME)
    np.testing.assert_array_equal(table.column("robot.q[1]"), -Q)


@pytest.mark.parametrize(
    ("kind", "advice"),
    [
        ("Simulink.SimulationData.Dataset", r"writetimetable\(extractTimetable\(data\), 'run.csv'\)"),
        ("timeseries", r"timeseries2timetable\(data\)"), ("robotarm", "save its numbers as arrays"),
    ],
)  # fmt: skip
def test_a_file_of_matlabs_objects_is_refused_with_what_writes_them_as_a_table(tmp_path, kind, advice):
    import h5py

    with h5py.File(tmp_path / "run.mat", "w", userblock_size=512) as file:
        stored = file.create_dataset("data", data=np.array([[0xDD000000, 2, 1, 1, 1, 1]], dtype="u4"))
        stored.attrs["MATLAB_class"], stored.attrs["MATLAB_object_decode"] = np.bytes_(kind), np.int32(3)
        file.create_dataset("#sigstream#/0/#data#", data=np.arange(100, dtype="u1"))
    with pytest.raises(
        InputError, match=f"'data' is an object of MATLAB's class {kind}.*{advice}"
    ) as refused:
        inventory(tmp_path / "run.mat", rate=1000.0)
    assert "\n" not in str(refused.value) and "--rate" not in str(refused.value)
    with h5py.File(tmp_path / "run.mat", "a") as file:
        file["t"], file["q"] = TIME, Q
    assert list(Table.load(tmp_path / "run.mat").columns) == ["q", "t"]


def test_a_few_values_are_no_recording_of_which_a_rate_would_tell_the_times(tmp_path):
    np.savez(tmp_path / "run.npz", data=np.array([7.0, 2.0, 1.0, 1.0, 1.0, 1.0]))
    with pytest.raises(InputError, match=r"holds no recording: its columns have 6 values \(data\)"):
        inventory(tmp_path / "run.npz")


def test_hdf5_that_claims_to_hold_too_much_is_refused(tmp_path):
    import h5py

    with h5py.File(tmp_path / "run.h5", "w") as file:
        file.create_dataset("q", (10**10,), "f8", chunks=(10**6,), compression="gzip")
    with pytest.raises(InputError, match="claims to hold more than"):
        Table.load(tmp_path / "run.h5")


def test_hdf5_without_its_library_is_refused_with_what_to_install(tmp_path, monkeypatch):
    hdf5(tmp_path / "run.h5")
    monkeypatch.setitem(sys.modules, "h5py", None)
    with pytest.raises(InputError, match=r"run\.h5: reading HDF5 needs h5py: pip install"):
        Table.load(tmp_path / "run.h5")


def test_parquet_without_its_library_is_refused_with_what_to_install(tmp_path, monkeypatch):
    (tmp_path / "run.parquet").write_bytes(b"PAR1")
    monkeypatch.setitem(sys.modules, "pyarrow.parquet", None)
    with pytest.raises(InputError, match=r"run\.parquet: reading Parquet needs pyarrow: pip install"):
        Table.load(tmp_path / "run.parquet")


def test_names_that_do_not_belong_to_the_rows_are_refused_with_their_line():
    with pytest.raises(InputError, match="run.csv: line 2 has 2 columns, the rows have 3"):
        dialect_of(["# title\n", "t,q\n", "0,1,2\n", "1,2,3\n"], "run.csv")


def test_columns_of_one_name_are_numbered_before_their_unit_and_told(tmp_path):
    path = tmp_path / "run.csv"
    rows = "\n".join(f"{0.01 * k},{k % 7},{k % 5},{k % 3}" for k in range(60))
    path.write_text(f"t,tau (Nm),tau (Nm),tau (Nm)\n{rows}\n")
    table = Table.load(path)
    assert list(table.columns) == ["t", "tau (Nm)", "tau.1 (Nm)", "tau.2 (Nm)"]
    assert np.array_equal(table.column("tau.2 (Nm)"), np.arange(60) % 3)
    assert any("line 1 names several columns 'tau (Nm)'" in note for note in table.notes)
    assert any("several columns 'tau (Nm)'" in note for note in inventory(path).notes)


@pytest.mark.parametrize(
    "name", ["time (millisec)", "Time [ticks of 1 ms]", "timestamp (msecs)", "time (millisecs)"]
)
def test_a_time_is_known_by_its_name_whatever_stands_in_brackets_behind_it(tmp_path, name):
    step = np.random.default_rng(0).integers(1, 4, 200)  # of ms: too uneven to be known without its name
    rows = "\n".join(f"{time},{np.sin(0.01 * time):.6f}" for time in np.cumsum(step))
    (tmp_path / "run.csv").write_text(f"{name},position (degree)\n{rows}\n")
    clock = inventory(tmp_path / "run.csv").clock
    assert clock.column == name and clock.scale == 1e-3


TRACE = "[key]; [value]\nVersion; 0x03050000\nName; Application.Trace\nEveryNCycles; 1\n"


def trace(*variables: tuple[str, range]) -> str:
    """A trace of CODESYS of variables with the times [ms] of their samples; the value is a hundredth of the time."""
    parts = [
        f"{number}.Variable; {name}\n{number}.GraphColor; 4282811060\n{number}.Data; \n" + "".join(f"; {t}; {0.01 * t}\n" for t in times)
        for number, (name, times) in enumerate(variables)
    ]  # fmt: skip
    return TRACE + "".join(parts)


@pytest.mark.parametrize("other", [range(0, 2000, 20), range(100, 1900, 20)])
def test_a_trace_of_codesys_is_read_variable_by_variable(tmp_path, other):
    (tmp_path / "run.csv").write_text(trace(("Main.Speed", range(0, 2000, 20)), ("Main.Torque", other)))
    table = Table.load(tmp_path / "run.csv")
    assert list(table.columns) == ["time", "Main.Speed", "Main.Torque"]
    assert np.array_equal(table.column("time"), np.arange(0.0, 2000.0, 20.0))
    told = np.isfinite(table.column("Main.Torque"))
    assert np.array_equal(table.column("time")[told], np.array(other, dtype=float))
    assert np.allclose(table.column("Main.Torque")[told], 0.01 * np.array(other))
    assert inventory(tmp_path / "run.csv").clock.scale == 1e-3


def test_a_damaged_sample_of_a_trace_is_refused_with_its_line(tmp_path):
    (tmp_path / "run.csv").write_text(trace(("Main.Speed", range(0, 2000, 20))) + "; 2000; many\n")
    with pytest.raises(InputError, match="line 108 of the trace holds no time and value"):
        Table.load(tmp_path / "run.csv")
