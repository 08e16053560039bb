"""Files made to do harm: refused in one line or read, in little time and memory, and nothing in them is carried out."""

import gzip
import io
import os
import struct
import subprocess
import sys
import tempfile
import warnings
import zipfile
from contextlib import suppress
from pathlib import Path

import numpy as np
import pytest
from fuzz import Watch, attempt, warm_up
from fuzz_bags import OWN
from fuzz_formats import long_tables, robots
from fuzz_targets import EXPERIMENT, TARGETS, Target
from hypothesis import given, settings
from hypothesis import strategies as st
from refusals import refusal
from scipy.io import savemat

from rhythmid import document
from rhythmid.body.mujoco_body import MujocoBody
from rhythmid.errors import LONGEST_MESSAGE, InputError
from rhythmid.experiment import Experiment
from rhythmid.record import compression
from rhythmid.record.block import Block, Topic
from rhythmid.record.columns import read_columns
from rhythmid.record.field import Field
from rhythmid.record.gaps import cut_at_gaps
from rhythmid.record.inventory import inventory
from rhythmid.record.message_types import stamp_path, type_fields, typestore
from rhythmid.record.read import read_record
from rhythmid.record.signals import Signals
from rhythmid.record.table import Table
from rhythmid.start.start import start

BENCHMARKS = Path(__file__).parents[2] / "benchmarks"
ZEROS = b"\0" * (1 << 20)


@pytest.fixture(scope="module")
def watch() -> Watch:
    return Watch()


@pytest.fixture(scope="module", params=TARGETS)
def target(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Target:
    """A reader that has loaded what it needs."""
    found = TARGETS[request.param]
    warm_up(found, tmp_path_factory.mktemp("warm"))
    return found


IN_GRAMS = """
import math, sys
from dataclasses import replace
from pathlib import Path
from fuzz import campaign
from fuzz_targets import EXPERIMENT, TARGETS, Target
target = replace(TARGETS["model"], spoil=lambda rng, data: data.replace(b"unit: kg", b"unit: g"))
tally = campaign(target, 0, 0, 1, math.inf, Path(sys.argv[1]))
print(tally.refused, tally.failures)
"""


def test_what_the_first_foreign_unit_loads_is_not_taken_for_a_pickle_in_the_file(tmp_path):
    # in a process of its own: in this one a unit may have been asked for before
    path = os.pathsep.join([str(BENCHMARKS), os.environ.get("PYTHONPATH", "")])
    done = subprocess.run(
        [sys.executable, "-c", IN_GRAMS, str(tmp_path)], env={**os.environ, "PYTHONPATH": path}, capture_output=True, text=True
    )  # fmt: skip
    assert done.stdout == "1 {}\n", done.stderr


@settings(max_examples=15)
@given(number=st.integers(0, 2**32))
def test_a_spoilt_file_is_read_or_refused_in_one_line(target, number, tmp_path_factory, watch):
    folder = tmp_path_factory.mktemp("hostile")
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(tempfile, "tempdir", str(folder))
        outcome, kind = attempt(target, target.hostile(0, number), folder, number, watch)
    assert outcome in ("accepted", "refused"), kind


# YAML


def test_aliases_that_stand_for_billions_of_values_are_refused(bounded):
    lines = ["a0: &a0 [x, x, x, x, x, x, x, x, x, x]"]
    lines += [f"a{k}: &a{k} [{', '.join([f'*a{k - 1}'] * 10)}]" for k in range(1, 12)]
    assert "holds more than 200000 values" in refusal(lambda: document.parse("\n".join(lines), "model.yaml"))


@pytest.mark.parametrize("text", ["[" * 20_000, "- " * 20_000, "{a: " * 20_000, "&a [*a]", "? " * 20_000])
def test_deep_and_endless_yaml_is_refused(text, bounded):
    refusal(lambda: document.parse(text, "model.yaml"))


def test_long_keys_above_many_values_take_no_memory(bounded):
    text = "? " + "k" * 1_000_000 + "\n: [" + "0, " * 50_000 + "0]"
    assert "a key of more than" in refusal(lambda: document.parse(text, "model.yaml"))


def test_a_document_of_many_megabytes_is_not_even_read(tmp_path, bounded):
    (tmp_path / "model.yaml").write_bytes(b"# \n" * (document.LARGEST // 3 + 10))
    assert "is too large" in refusal(lambda: document.read(tmp_path / "model.yaml"))


@pytest.mark.parametrize(
    "tag", ["!!timestamp x", "!!int ''", "!!bool x", "!!float ''", "!!python/name:os.system x"]
)
def test_a_value_that_its_tag_does_not_fit_is_refused_with_its_line(tag):
    assert refusal(lambda: document.parse(f"a: 1\nb: {tag}", "model.yaml")).startswith("model.yaml:2")


def test_what_a_refusal_quotes_can_neither_break_the_line_nor_command_the_terminal():
    line = str(InputError("a\nb\x1b[2Jc" + "x" * 10_000))
    assert line.startswith("a b [2Jc") and line.isprintable() and len(line) == LONGEST_MESSAGE


# Messages


def own(definition: str) -> Topic:
    return Topic("/legs", OWN, definition=definition, definition_format="ros2msg")


def test_a_type_with_an_infinite_constant_is_refused():
    assert "cannot be read" in refusal(lambda: typestore(own("float64 FAR=1e999\nfloat64 position\n")))


@pytest.mark.parametrize(
    "definition",
    [
        "Legs inner\n",
        "Leg[1000000000] legs\n" + "=" * 80 + "\nMSG: robot_msgs/Leg\nfloat64 angle\n",
        "string[1000000000] names\n",
        "float64[99999999999] angles\n",
        "float64[0] nothing\n",
        "Leg[] legs\n" + "=" * 80 + "\nMSG: robot_msgs/Leg\nfloat64[0] angle\n",
        "Leg[9000] legs\n"
        + "=" * 80
        + "\nMSG: robot_msgs/Leg\nToe[9000] toes\n"
        + "=" * 80
        + "\nMSG: robot_msgs/Toe\nint64[9] a\n",
    ],
)
def test_types_that_no_message_could_have_are_refused(definition, bounded):
    assert "cannot be read" in refusal(lambda: type_fields(own(definition)))


def test_types_that_double_at_every_level_take_no_time(bounded):
    levels = "".join("=" * 80 + f"\nMSG: robot_msgs/A{k}\nA{k + 1} a\nA{k + 1} b\n" for k in range(40))
    end = "=" * 80 + "\nMSG: robot_msgs/A40\nint8 a\n"
    assert "cannot be read" in refusal(lambda: type_fields(own("A0 a\n" + levels + end)))


def test_fields_whose_names_clash_are_refused():
    assert "cannot be read" in refusal(lambda: typestore(own("int8 a\nint8 a\n")))


def test_a_header_that_is_none_has_no_stamp():
    header = "std_msgs/Header header\n" + "=" * 80 + "\nMSG: std_msgs/Header\nstring when\n"
    assert stamp_path(own(header)) is None
    header = "std_msgs/Header header\n" + "=" * 80 + "\nMSG: std_msgs/Header\nbuiltin_interfaces/Time stamp\n"
    clock = "=" * 80 + "\nMSG: builtin_interfaces/Time\nstring sec\nuint32 nanosec\n"
    assert stamp_path(own(header + clock)) is None


@pytest.mark.parametrize("text", ["data[²]", "data[" + "1" * 5000 + "]"])
def test_a_position_is_no_number_of_any_length(text):
    assert isinstance(Field.parse(text).steps[1], tuple)


def test_a_truth_value_of_any_byte_is_one_or_zero_by_either_way_of_reading():
    topic, data = own("bool on\n"), b"\0\1\0\0\x08"
    place = np.array([0])
    block = Block(topic, data, place, place + len(data), place)
    field = Field.parse("on")
    for direct in (True, False):
        assert read_columns([block], {topic.name: [field]}, direct)[topic.name].values[field] == [1.0]


def test_a_signalling_nan_is_a_nan_without_a_warning(recwarn):
    topic, data = own("float32 angle\n"), b"\0\1\0\0" + struct.pack("<I", 0x7F800001)
    place = np.array([0])
    block = Block(topic, data, place, place + len(data), place)
    field = Field.parse("angle")
    for direct in (True, False):
        assert np.isnan(read_columns([block], {topic.name: [field]}, direct)[topic.name].values[field])
    assert not recwarn.list


# Tables


def saved(path: Path, **arrays) -> Path:
    np.savez_compressed(path, **arrays)
    return path


def test_archives_and_packed_texts_that_would_fill_the_memory_are_refused(tmp_path, monkeypatch, bounded):
    monkeypatch.setattr(compression, "HARMLESS", 1 << 20)
    path = saved(tmp_path / "bomb.npz", a=np.zeros(8 << 20))
    assert "claims to hold" in refusal(lambda: Table.load(path))
    (tmp_path / "bomb.csv.gz").write_bytes(gzip.compress(b"t,u\n" + b"0,0\n" * (8 << 20), 9))
    assert "holds more than" in refusal(lambda: Table.load(tmp_path / "bomb.csv.gz"))


def test_an_array_that_claims_to_be_endless_is_refused(tmp_path, bounded):
    file = io.BytesIO()
    np.lib.format.write_array_header_1_0(file, {"descr": "<f8", "fortran_order": False, "shape": (2**60,)})
    with zipfile.ZipFile(tmp_path / "a.npz", "w") as archive:
        archive.writestr("a.npy", file.getvalue() + bytes(64))
    assert "cannot be read as a table" in refusal(lambda: Table.load(tmp_path / "a.npz"))


class Told:
    """A pickle that would say so when it is loaded."""

    def __reduce__(self):
        return print, ("a pickle was loaded",)


def test_no_pickle_is_loaded(tmp_path, capsys):
    np.savez(tmp_path / "a.npz", t=np.arange(9.0), a=np.array([Told()], dtype=object))
    refusal(lambda: Table.load(tmp_path / "a.npz"))
    with (tmp_path / "b.npz").open("wb") as file:
        np.save(file, np.array([Told()], dtype=object), allow_pickle=True)
    refusal(lambda: Table.load(tmp_path / "b.npz"))
    assert "loaded" not in capsys.readouterr().out


def test_a_matlab_file_that_kills_its_reader_is_refused(tmp_path):
    file = io.BytesIO()
    savemat(file, {"u": np.arange(50.0)})
    spoilt = bytearray(file.getvalue())
    at = spoilt.index(struct.pack("<II", 9, 400))  # double precision, 50 numbers
    spoilt[at : at + 4] = struct.pack("<I", 0x2009)  # a type far beyond those that there are
    (tmp_path / "a.mat").write_bytes(spoilt)
    assert "cannot be read as a table" in refusal(lambda: Table.load(tmp_path / "a.mat"))


def test_one_long_cell_does_not_make_all_others_as_long(tmp_path, bounded):
    rows = b"".join(b"%d,a\n" % k for k in range(20_000))
    (tmp_path / "a.csv").write_bytes(b"t,note\n" + b"0," + b"x" * 100_000 + b"\n" + rows)
    assert len(Table.load(tmp_path / "a.csv").columns["note"]) == 20_001


def test_numbers_near_the_largest_are_no_time(tmp_path, recwarn):
    (tmp_path / "a.csv").write_text("q,u\n" + "".join(f"{k}e200,{k % 7}\n" for k in range(1, 50)))
    assert "goes forward like a time" in refusal(lambda: inventory(tmp_path / "a.csv"))
    assert not recwarn.list


# Records


def test_a_forcing_too_fast_to_be_followed_is_refused(tmp_path, bounded):
    (tmp_path / "run.csv").write_text("t,y\n" + "".join(f"{k},{k % 7}\n" for k in range(50)))
    signals = Signals.from_text(
        "time: {column: t}\noutput: {column: y}\nforcing: {amplitude: 1, frequency: 1.0e9}",
        tmp_path / "signals.yaml",
    )
    assert "cannot be followed" in refusal(lambda: read_record(tmp_path / "run.csv", signals))


@pytest.mark.parametrize("levels", [1, 5])
def test_a_stamp_far_in_the_future_is_no_gap_that_is_filled(tmp_path, bounded, levels):
    """Four thousand million samples are missing before it."""
    rows = [f"{k / 1000},{k % 7},{k % levels}" for k in range(60)]
    (tmp_path / "run.csv").write_text("t,y,u\n" + "\n".join([*rows, "4200000.0,1,1"]) + "\n")
    signals = Signals.from_text(
        "time: {column: t}\ninput: {column: u}\noutput: {column: y}", tmp_path / "signals.yaml"
    )
    whole = cut_at_gaps(read_record(tmp_path / "run.csv", signals)).whole
    assert whole.input is not None and len(whole.input) < 200


@pytest.mark.parametrize("sizes", [("e300", ""), ("", "e300"), ("e160", "e160")])
def test_values_that_no_machine_has_are_refused_with_their_place_and_without_a_warning(
    tmp_path, recwarn, sizes
):
    # the values stay for two samples each
    rows = [f"{k},{k // 2 % 7}{sizes[0]},{k // 2 % 5}{sizes[1]}" for k in range(60) if k % 20]
    (tmp_path / "run.csv").write_text("t,y,u\n" + "\n".join(rows) + "\n")
    signals = Signals.from_text(
        "time: {column: t}\ninput: {column: u}\noutput: {column: y}", tmp_path / "signals.yaml"
    )
    with pytest.raises(InputError, match="are infinite, the first at .* 1e\\+100"):
        read_record(tmp_path / "run.csv", signals)
    assert not recwarn.list


TABLE = "t,y,u\n" + "".join(f"{k},{k % 7},{k % 5}\n" for k in range(50))


def stated(tmp_path: Path, forcing: str, scale: str) -> Signals:
    """Signals of TABLE with a forcing by formula and a factor of the command."""
    (tmp_path / "run.csv").write_text(TABLE)
    text = f"time: {{column: t}}\ninput: {{column: u, scale: {scale}}}\noutput: {{column: y}}\nforcing: {forcing}"
    return Signals.from_text(text, tmp_path / "signals.yaml")


def test_a_forcing_without_amplitude_is_none(tmp_path):
    signals = stated(tmp_path, "{amplitude: 0.0, frequency: 61.4}", "1.0")
    forcing = read_record(tmp_path / "run.csv", signals).forcing
    assert forcing is not None and not forcing.value.any()


def test_a_factor_beyond_the_largest_number_is_refused_without_a_warning(tmp_path, recwarn):
    signals = stated(tmp_path, "{amplitude: 1.0, frequency: 0.5}", "1.0e308")
    assert "are infinite" in refusal(lambda: read_record(tmp_path / "run.csv", signals))
    assert not recwarn.list


def test_the_name_of_a_model_may_be_longer_than_any_file_s(tmp_path):
    text = EXPERIMENT.decode().replace("model.yaml", "m" * 300)
    (tmp_path / "experiment.yaml").write_text(text)
    (tmp_path / "delays.csv").write_text("time,delay\n0,0.01\n5,0.02\n")
    assert "no such file" in refusal(lambda: Experiment.load(tmp_path / "experiment.yaml"))


def test_a_table_whose_name_no_file_can_have_is_refused_in_one_line(tmp_path):
    text = "time: {column: t}\noutput: {column: y, file: run." + "9" * 400 + "}"
    (tmp_path / "signals.yaml").write_text(text)
    with pytest.raises(InputError, match="is not a table"):
        read_record(tmp_path / "signals.yaml")


# Tables


def test_init_of_a_table_with_a_number_beyond_all_bounds_warns_of_nothing(tmp_path):
    text = long_tables()[0].decode().splitlines()
    text[50] = ",".join([text[50].split(",")[0], "1e999", text[50].split(",")[2]])
    text[60] = ",".join([text[60].split(",")[0], "-1e308", text[60].split(",")[2]])
    (tmp_path / "run.csv").write_text("\n".join(text))
    with warnings.catch_warnings():
        warnings.simplefilter("error", RuntimeWarning)
        with suppress(InputError):
            start([tmp_path / "run.csv"])


# Robots


@pytest.mark.parametrize("name", [b"upper", b"shoulder"])
def test_a_robot_with_a_name_that_is_no_text_is_refused(tmp_path, name):
    (tmp_path / "robot.urdf").write_bytes(robots()[0].replace(name, name + b"\xff"))
    assert "is not UTF-8 text" in refusal(lambda: MujocoBody.load(tmp_path / "robot.urdf", contacts=False))
