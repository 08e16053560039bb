"""Files of other programs: dialects of text, workbooks, HDF5, arrays, MATLAB's objects, folders, several runs in one file,
robot files, tables of a delay; valid, corrupted, and read."""

import io
import json
import random
import zipfile
from collections.abc import Callable, Sequence
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from fuzz_inputs import COUNT, VALUES
from matlab_objects import EVEN, timeseries_file
from mutation import spoil_bytes, spoil_text

from rhythmid.body.mujoco_body import MujocoBody
from rhythmid.record.grouped_runs import grouped_runs
from rhythmid.record.inventory import inventory
from rhythmid.record.split import recordings, split, split_runs
from rhythmid.record.table import Table
from rhythmid.start.start import start
from rhythmid.time_table import read_time_table

STEP = 0.01  # s
ROWS = [(STEP * k, VALUES[k], VALUES[-k]) for k in range(COUNT)]
LONG = 400  # rows of the tables from which roles and a model are guessed


# Text

LVM = (
    "LabVIEW Measurement\t\nWriter_Version\t2\nSeparator\tTab\nX_Columns\tOne\nDate\t2024/01/05\n***End_of_Header***\t\n\t\n"
    f"Channels\t2\t\t\t\nSamples\t{COUNT}\t{COUNT}\t\t\nX0\t0.0\t0.0\t\t\nDelta_X\t0.01\t0.01\t\t\n"
    "***End_of_Header***\t\t\t\t\nX_Value\tPosition\tForce\tComment\n"
)


def _joined(rows: Sequence[Sequence[object]], separator: str = ",", end: str = "\n") -> str:
    return end.join(separator.join(map(str, row)) for row in rows) + "\n"


def dialects() -> list[bytes]:
    """One table for each reader of a dialect, most of them of loggers and laboratory programs."""
    trace = "".join(
        f"{number}.Variable;Axis.{name}\n{number}.Color;255\n{number}.Data\n"
        + "".join(f";{t:.3f};{(q, u)[number]:.3f}\n" for t, q, u in ROWS)
        for number, name in enumerate(("position", "torque"))
    )
    times = [f"05.01.2024 12:00:{t:06.3f}" for t, _, _ in ROWS]
    return [one.encode() for one in (
        LVM + _joined([(f"{t:.2f}", q, u) for t, q, u in ROWS], "\t"),
        "Name;Trace1\nVersion;3.5\n" + trace,
        "".join(f"Time: {5000 + k} Position: {q} Current: {u} mA\n" for k, (_, q, u) in enumerate(ROWS)),
        "booting\n" + "".join(f"t={t:.2f}, angle={q} deg, u={u}\n" for t, q, u in ROWS),
        " Sample   Time     Encoder 1 Pos   Control Effort\n\n data = [\n".replace("[\n", "[ 0 0.0 1 2;\n")
        + _joined([(k, t, q, u) for k, (t, q, u) in enumerate(ROWS)], "  ", ";\n") + "];\n",
        "t,q,tau\n" + "".join(f'{t:.2f},"[{q}, {u}]","[{u} {q}]"\n' for t, q, u in ROWS),
        "t,q,u,event\n" + "".join(f"{t:.2f},{q},{u}" + ",start\n" * (k % 9 == 0) + "\n" * (k % 9 > 0) for k, (t, q, u) in enumerate(ROWS)),
        "mass,rate\n0.5,100\n\ntime,q,u\n" + _joined(ROWS),
        "# sample period: 0.01 s\nq,u\n" + _joined([(q, u) for _, q, u in ROWS]),
        '"/joint/position[0]_x","/joint/position[0]_y","/joint/effort[0]_x","/joint/effort[0]_y"\n'
        + "".join(f"{t:.3f},{q},{t + 0.004:.3f},{u},\n" for t, q, u in ROWS),
        "Time - angle;Amplitude - angle;Time - torque;Amplitude - torque\n" + _joined([(t, q, t, u) for t, q, u in ROWS], ";"),
        "secs,nsecs,q,u\n" + "".join(f"1700000000,{int(1e9 * t)},{q},{u}\n" for t, q, u in ROWS),
        "time;q;u\n" + "".join(f"{time};{q};{u}\n" for time, (_, q, u) in zip(times, ROWS)),
        "t;pos;vel\nms;mm;mm/s\n" + "".join(f"{1e3 * t:.0f} ms;{q} mm;{u} mm/s\n" for t, q, u in ROWS),
        _joined([[t for t, _, _ in ROWS * 3], [q for _, q, _ in ROWS * 3]], " "),
        "version https://git-lfs.github.com/spec/v1\noid sha256:" + "0" * 64 + "\nsize 12\n",
    )]  # fmt: skip


def folders() -> list[bytes]:
    """Two streams of one recording in one input."""
    one, other = (
        f"%time,field.{name}\n" + _joined([(t + shift, value) for t, value, _ in ROWS])
        for name, shift in (("angle", 0.0), ("effort", 0.004))
    )
    return [(one + PARTED + other).encode(), ("angle\n" + _joined([(q,) for _, q, _ in ROWS]) + PARTED + "effort\n"
            + _joined([(u,) for _, _, u in ROWS])).encode()]  # fmt: skip


PARTED = "=====\n"
"""Between the files of a folder in one input."""


def use_folder(data: bytes, folder: Path, number: int) -> None:
    inside = folder / "streams"
    inside.mkdir()
    for place, part in enumerate(data.split(PARTED.encode())[:4]):
        (inside / f"stream{place}.csv").write_bytes(part)
    inventory(inside, rate=None if number % 2 else 100.0)


# Workbooks: the members of the archive are corrupted, because its checksums would detect other damage


def workbooks() -> list[bytes]:
    """A member's name and text, with the others unchanged."""
    return [name.encode() + b"\n" + content for name, content in _members().items()]


@cache
def _members() -> dict[str, bytes]:
    from datetime import datetime, timedelta

    from openpyxl import Workbook

    book = Workbook()
    sheet: Any = book.worksheets[0]
    for row in (["Test"], [], ["Time", "Position", "Torque", "When", "note"], ["s", "deg", "Nm", "", ""]):
        sheet.append(row)
    for t, q, u in ROWS:
        sheet.append([t, q, u if u > -1.0 else None, datetime(2024, 1, 5) + timedelta(seconds=t), "a"])
    book.create_sheet("other").append([1, 2, 3])
    file = io.BytesIO()
    book.save(file)
    with zipfile.ZipFile(file) as archive:
        return {name: archive.read(name) for name in archive.namelist()}


def spoil_workbook(rng: random.Random, valid: bytes) -> bytes:
    name, _, content = valid.partition(b"\n")
    spoil = spoil_text if rng.random() < 0.7 else spoil_bytes
    made = {**_members(), name.decode(): spoil(rng, content)}
    if rng.random() < 0.1:
        del made[name.decode()]
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED) as archive:
        for member, kept in made.items():
            archive.writestr(member, kept)
    return spoil_bytes(rng, file.getvalue()) if rng.random() < 0.2 else file.getvalue()


# Binary files


def hdf5s() -> list[bytes]:
    """Plain data sets, MATLAB's structs and cells, and what Simulink logs."""
    return [_hdf5(fill) for fill in (_plain, _plain, _of_matlab, _of_simulink)]


def _hdf5(fill: Callable[[Any], None]) -> bytes:
    import h5py

    file = io.BytesIO()
    with h5py.File(file, "w") as made:
        fill(made)
    return file.getvalue()


def _plain(file: Any) -> None:
    file["t"], file["run/q"], file["run/names"] = np.arange(COUNT) * STEP, VALUES, np.array([b"a", b"b"])
    file.create_dataset("run/u", data=np.column_stack([VALUES, VALUES]), chunks=(8, 2), compression="gzip")


def _text(group: Any, name: str, value: str) -> None:
    group[name] = np.array([[ord(letter)] for letter in value], dtype=np.uint16)
    group[name].attrs["MATLAB_class"] = np.bytes_("char")


def _of_matlab(file: Any) -> None:
    import h5py

    file["#refs#/a"], file["#refs#/b"] = VALUES[None, :], VALUES[None, ::-1]
    cells = file.create_dataset("data/runs", (2, 1), dtype=h5py.ref_dtype)
    cells[0, 0], cells[1, 0] = file["#refs#/a"].ref, file["#refs#/b"].ref
    cells.attrs["MATLAB_class"] = np.bytes_("cell")
    file["data/t"] = np.arange(COUNT)[None, :] * STEP
    file["data/t"].attrs["MATLAB_class"] = np.bytes_("double")
    _text(file, "data/label", "angle")


def _of_simulink(file: Any) -> None:
    one = file.create_group("#refs#/d/Values")
    _text(one, "Name", "Motor Speed")
    one["DataR2"] = np.array([[1.0]])
    about = one.create_group("SignalAttributes")
    _text(about, "ClassName", "double")
    about["Dimension"] = np.array([[1.0]])
    one["CompressedTime"] = np.array([0.0, STEP, float(COUNT)])
    for empty in ("Time", "TimeR2"):
        one[empty] = np.zeros(2, dtype=np.uint64)
        one[empty].attrs["MATLAB_empty"] = np.uint8(1)
    file["#sigstream#/1/#data#"] = np.frombuffer(VALUES.tobytes(), dtype=np.uint8)


def npys() -> list[bytes]:
    record = np.zeros(COUNT, dtype=[("t", "f8"), ("q", "f8")])
    record["t"], record["q"] = np.arange(COUNT) * STEP, VALUES
    arrays = (np.column_stack([np.arange(COUNT) * STEP, VALUES]), record, np.array([{"a": 1}], dtype=object))
    made = []
    for array in arrays:
        file = io.BytesIO()
        np.save(file, array, allow_pickle=True)
        made.append(file.getvalue())
    return [made[0], *made]


def objects() -> list[bytes]:
    """A `timeseries` of MATLAB."""
    return [timeseries_file(np.array(VALUES)[:, None], EVEN, (float(COUNT), 0.0, STEP))]


# What `init` and `split` do with tables


def long_tables() -> list[bytes]:
    """Tables from which roles and a nominal model can be guessed."""
    rng = np.random.default_rng(3)
    time = STEP * np.arange(LONG)
    force = np.cumsum(rng.standard_normal(LONG)) * 0.1
    angle = np.convolve(force, np.exp(-time[:80]) * np.sin(6.0 * time[:80]) * STEP)[:LONG]
    rows = _joined([(f"{t:.2f}", f"{q:.5f}", f"{u:.4f}") for t, q, u in zip(time, angle, force)])
    return [("time [s],angle [rad],torque [Nm]\n" + rows).encode(), ("t,q,u\n" + rows).encode()]


def use_init(data: bytes, folder: Path, number: int) -> None:
    (folder / "run.csv").write_bytes(data)
    start([folder / "run.csv"], rate=None if number % 2 else 100.0)


def several_runs() -> list[bytes]:
    rows = [{"episode_index": k // 8, "t": STEP * (k % 8), "q": VALUES[k]} for k in range(COUNT)]
    lengths = {"slow": COUNT, "fast": COUNT - 5}
    arrays = {
        name: [[STEP * k, VALUES[k], VALUES[-k]] for k in range(count)] for name, count in lengths.items()
    }
    structs = {
        f"run{number}": {"t": [STEP * k + number for k in range(count)], "q": list(VALUES[:count])}
        for number, count in enumerate(lengths.values())
    }
    return [json.dumps(one).encode() for one in (rows, arrays, structs)]


def use_split(data: bytes, folder: Path, number: int) -> None:
    (folder / "runs.json").write_bytes(data)
    table = Table.load(folder / "runs.json")
    runs = grouped_runs(table)
    if runs is not None:
        split_runs(table, runs, folder / "out")
    else:
        split(table, recordings(table)[1], folder / "out")


# Robots and delays

LINK = '<inertial><origin xyz="0 0 -0.1"/><mass value="1"/><inertia ixx="0.01" iyy="0.01" izz="0.001" ixy="0" ixz="0" iyz="0"/></inertial>'
URDF = f"""<robot name="arm"><link name="base"/>
<link name="upper">{LINK}<collision><geometry><mesh filename="package://arm/upper.dae"/></geometry></collision></link>
<link name="tool">{LINK}<visual><geometry><sphere radius="0.01"/></geometry></visual></link>
<joint name="shoulder" type="continuous"><parent link="base"/><child link="upper"/><axis xyz="0 1 0"/></joint>
<joint name="grip" type="prismatic"><parent link="upper"/><child link="tool"/><axis xyz="1 0 0"/><limit lower="0" upper="0.01" effort="1" velocity="1"/></joint>
</robot>
"""
MJCF = """<mujoco><option timestep="0.001"/><worldbody><body name="upper"><joint name="shoulder" type="hinge" axis="0 1 0" damping="0.1"/>
<geom type="capsule" size="0.02" fromto="0 0 0 0 0 -0.3" mass="1"/><body name="fore" pos="0 0 -0.3"><joint name="elbow" axis="0 1 0"/>
<inertial pos="0 0 -0.1" mass="0.5" diaginertia="0.01 0.01 0.001"/></body></body></worldbody>
<actuator><motor joint="shoulder"/></actuator></mujoco>
"""


def robots() -> list[bytes]:
    return [URDF.encode(), MJCF.encode()]


def use_robot(data: bytes, folder: Path, number: int) -> None:
    path = folder / ("robot.urdf" if b"<mujoco" not in data else "robot.xml")
    path.write_bytes(data)
    MujocoBody.load(path, contacts=False)


def profiles() -> list[bytes]:
    return [b"time,delay\n0,0.01\n# later\n5,0.02\n7,0.03\n", b"0,0.01\n1.5,0.02\n"]


def use_profile(data: bytes, folder: Path, number: int) -> None:
    (folder / "delays.csv").write_bytes(data)
    times, values = read_time_table(folder / "delays.csv", "delay [s]")
    if not (len(times) == len(values) and np.isfinite(times).all() and np.isfinite(values).all()):
        raise AssertionError("accepted numbers that are not finite")
