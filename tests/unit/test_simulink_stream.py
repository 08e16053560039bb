"""Signals that Simulink logged into a MAT file of version 7.3, written here as MATLAB writes them."""

import numpy as np
import pytest

from rhythmid.errors import InputError
from rhythmid.record.table import Table

h5py = pytest.importorskip("h5py")
COUNT = 400
STEP = 0.002
SPEED = np.sin(np.linspace(0.0, 20.0, COUNT))
VOLTAGE = np.cos(np.linspace(0.0, 20.0, COUNT))


def text(group, name, value):
    group[name] = np.array([[ord(letter)] for letter in value], dtype=np.uint16)
    group[name].attrs["MATLAB_class"] = np.bytes_("char")


def empty(group, name):
    group[name] = np.zeros(2, dtype=np.uint64)
    group[name].attrs["MATLAB_empty"] = np.uint8(1)


def signal(file, key, name, number, values, listed=False, kind="double"):
    """One logged `timeseries`; its times as a step, or `listed`."""
    one = file.create_group(f"#refs#/{key}/Values")
    text(one, "Name", name)
    one["DataR2"] = np.array([[float(number)]])
    about = one.create_group("SignalAttributes")
    text(about, "ClassName", kind)
    about["Dimension"] = np.array([[1.0 if values.ndim == 1 else values.shape[1]]])
    if listed:
        empty(one, "CompressedTime")
        one["Time"] = STEP * np.arange(len(values))
    else:
        one["CompressedTime"] = np.array([0.0, STEP, float(len(values))])
        empty(one, "Time")
    empty(one, "TimeR2")
    file[f"#sigstream#/{number}/#data#"] = np.frombuffer(values.tobytes(), dtype=np.uint8)


@pytest.fixture
def path(tmp_path):
    return tmp_path / "run.mat"


def test_logged_signals_are_columns_called_as_in_simulink(path):
    with h5py.File(path, "w", userblock_size=512) as file:
        signal(file, "d", "Motor Speed", 1, SPEED.astype(np.float32), kind="single")
        signal(file, "f", "input", 0, VOLTAGE, listed=True)
    table = Table.load(path)
    assert set(table.columns) == {"input.Time", "input.input", "Motor Speed.Time", "Motor Speed.Motor Speed"}
    assert np.allclose(table.column("Motor Speed.Time"), STEP * np.arange(COUNT))
    assert np.allclose(table.column("Motor Speed.Motor Speed"), SPEED, atol=1e-6)
    assert np.array_equal(table.column("input.input"), VOLTAGE)


def test_a_signal_of_several_values_is_an_array(path):
    with h5py.File(path, "w") as file:
        signal(file, "d", "joints", 0, np.column_stack([SPEED, VOLTAGE]))
    assert np.array_equal(Table.load(path).column("joints.joints[1]"), VOLTAGE)


def test_signals_without_a_name_are_called_by_their_place(path):
    with h5py.File(path, "w") as file:
        signal(file, "d", "\x00\x00", 0, SPEED)
        signal(file, "f", "\x00\x00", 1, VOLTAGE)
    assert np.array_equal(Table.load(path).column("data[1].Data"), VOLTAGE)


def test_a_signal_whose_bytes_do_not_fit_its_times_is_left_out(path):
    with h5py.File(path, "w") as file:
        signal(file, "d", "speed", 0, SPEED)
        signal(file, "f", "short", 1, VOLTAGE)
        del file["#sigstream#/1/#data#"]
        file["#sigstream#/1/#data#"] = np.zeros(8, dtype=np.uint8)
    assert set(Table.load(path).columns) == {"speed.Time", "speed.speed"}


def test_more_samples_than_the_file_can_hold_are_refused(path):
    with h5py.File(path, "w") as file:
        signal(file, "d", "speed", 0, SPEED)
        del file["#refs#/d/Values/CompressedTime"]
        file["#refs#/d/Values/CompressedTime"] = np.array([0.0, STEP, 1e12])
    with pytest.raises(InputError, match="claims to hold more than"):
        Table.load(path)
