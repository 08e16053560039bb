"""Files of other programs are refused in one line that says what makes a bag or a table of them."""

from pathlib import Path

import numpy as np
import pytest
from rosbags.rosbag1 import Writer
from rosbags.typesys import Stores, get_typestore
from typer.testing import CliRunner

from rhythmid.cli import app
from rhythmid.errors import InputError
from rhythmid.record.bag import Bag
from rhythmid.record.inventory import inventory
from rhythmid.record.read import read_record
from rhythmid.record.table import Table


def bag_of_ros_1(path: Path) -> Path:
    store = get_typestore(Stores.ROS1_NOETIC)
    number = store.types["std_msgs/msg/Float64"]
    with Writer(path) as writer:
        connection = writer.add_connection("/angle", number.__msgtype__, typestore=store)
        for k in range(100):
            data = store.serialize_ros1(number(float(np.sin(0.1 * k))), number.__msgtype__)
            writer.write(connection, 10**18 + k * 10**7, data)
    return path


@pytest.mark.parametrize("read", [inventory, read_record, Bag, Table.load])
def test_a_bag_of_ros_1_is_refused_with_the_command_that_converts_it(tmp_path, read):
    bag = bag_of_ros_1(tmp_path / "old.bag")
    with pytest.raises(InputError, match="is a bag of ROS 1") as refused:
        read(bag)
    assert f"rosbags-convert --src {bag} --dst {tmp_path / 'old'}" in str(refused.value)


@pytest.mark.parametrize("command", [["init"], ["check"], ["split", "--out", "parts"]])
def test_the_commands_refuse_it_with_exit_code_2_and_a_folder_of_such_bags_too(tmp_path, command):
    bag = bag_of_ros_1(tmp_path / "old.bag")
    for source in (bag, tmp_path) if command[0] != "split" else (bag,):
        done = CliRunner().invoke(app, [command[0], str(source), *command[1:]])
        assert isinstance(done.exception, InputError) and "rosbags-convert --src" in str(done.exception)


@pytest.mark.parametrize("name", ["run.xls", "run.tdms", "run.mf4", "run.psdata", "run.pkl"])
def test_other_files_are_refused_with_what_to_do(tmp_path, name):
    (tmp_path / name).write_bytes(b"x")
    with pytest.raises(InputError, match="which is not read; save it as .csv"):
        inventory(tmp_path / name)


@pytest.mark.parametrize("shape", [(6,), (6, 1)])
def test_a_cell_of_matlab_with_a_few_numbers_for_each_time_is_an_array_of_as_many_columns(tmp_path, shape):
    from scipy.io import savemat

    values = np.random.default_rng(0).standard_normal((300, 6))
    cells = np.empty(300, dtype=object)
    for row, one in enumerate(values):
        cells[row] = one.reshape(shape)
    savemat(tmp_path / "run.mat", {"t": 0.01 * np.arange(300), "q": cells})
    table = Table.load(tmp_path / "run.mat")
    assert np.array_equal(table.column("q[5]"), values[:, 5])
    assert "q[6]" not in dict(table.vectors())
