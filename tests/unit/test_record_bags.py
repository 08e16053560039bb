"""Bags: what is written is read back, by the fast path and by the slow one alike."""

import numpy as np
import pytest

from rhythmid.errors import InputError
from rhythmid.record.bag import Bag
from rhythmid.record.bag_report import quality_report
from rhythmid.record.bag_writer import write_bag
from rhythmid.record.columns import read_columns
from rhythmid.record.field import Field
from rhythmid.record.messages import Messages
from rhythmid.record.read import read_record
from rhythmid.record.recover import recover

N = 4000
STAMPS = np.arange(N, dtype=np.int64) * 1_000_000
RNG = np.random.default_rng(4)
U, F, Y = RNG.standard_normal(N), np.cos(2e-9 * np.pi * STAMPS), RNG.standard_normal(N)
TOPICS = {
    "/hopper/excitation": Messages(STAMPS, effort=U),
    "/hopper/forcing": Messages(STAMPS, effort=F),
    "/hopper/joint_states": Messages(STAMPS + 15_100_000, position=Y, velocity=2 * Y, effort=3 * Y),
}


def bag(folder, name="bag", topics=TOPICS, **options):
    path = folder / name
    write_bag(path, topics, **options)
    return path


@pytest.mark.parametrize("storage", ["mcap", "sqlite3"])
def test_a_record_comes_back_as_it_was_written(tmp_path, storage):
    record = read_record(bag(tmp_path, storage=storage, run={"rate": 1000}))
    assert np.array_equal(record.input.value, U)
    assert np.array_equal(record.output.value, Y)
    assert np.array_equal(record.forcing.value, F)
    assert np.allclose(record.output.time - record.input.time[: len(Y)], 0.0151, atol=1e-12)
    assert record.run == {"rate": 1000}


@pytest.mark.parametrize("storage", ["mcap", "sqlite3"])
def test_the_fast_path_equals_the_deserialiser(tmp_path, storage):
    path = bag(tmp_path, storage=storage)
    wanted = {"/hopper/joint_states": [Field.parse("position[leg]"), Field.parse("effort[0]")]}
    fast = read_columns(Bag(path).blocks(lambda t: t.name in wanted), wanted)
    slow = read_columns(Bag(path).blocks(lambda t: t.name in wanted), wanted, direct=False)
    for name in wanted:
        for field in wanted[name]:
            assert np.array_equal(fast[name].values[field], slow[name].values[field])


def test_an_existing_bag_is_not_overwritten(tmp_path):
    path = bag(tmp_path)
    with pytest.raises(InputError, match="exist"):
        write_bag(path, TOPICS)


def test_the_uniform_grid_copies_samples_that_lie_on_it(tmp_path):
    uniform = read_record(bag(tmp_path)).uniform()
    assert uniform.rate == pytest.approx(1000.0)
    assert np.isin(uniform.output, Y).mean() > 0.99


def test_a_truncated_bag_gives_what_is_there_and_can_be_recovered(tmp_path):
    path = bag(tmp_path)
    file = next(path.glob("*.mcap"))
    broken = tmp_path / "broken.mcap"
    broken.write_bytes(file.read_bytes()[: int(0.6 * file.stat().st_size)])
    recover(broken, tmp_path / "mended")
    record = read_record(tmp_path / "mended")
    assert 100 < len(record.output) < N
    assert np.array_equal(record.output.value, Y[: len(record.output)])


def test_the_report_counts_messages_and_finds_the_gap(tmp_path):
    keep = np.ones(N, bool)
    keep[1000:1100] = False
    topics = dict(TOPICS)
    topics["/hopper/joint_states"] = Messages(STAMPS[keep], position=Y[keep])
    report = quality_report(bag(tmp_path, topics=topics))
    assert any("gap" in line for line in report.lines())
    assert report.to_dict()


def refused(folder, topics, match):
    with pytest.raises(InputError, match=match) as caught:
        read_record(bag(folder, topics=topics))
    assert "\n" not in str(caught.value)


def test_a_bag_without_the_output_is_refused_and_says_what_it_has(tmp_path):
    refused(tmp_path, {"/hopper/excitation": TOPICS["/hopper/excitation"]}, "joint_states")


def test_a_value_that_is_not_a_number_is_refused_with_its_place(tmp_path):
    bad = Y.copy()
    bad[1234] = np.nan
    refused(
        tmp_path,
        {**TOPICS, "/hopper/joint_states": Messages(STAMPS, position=bad)},
        "NaN|not a number|finite",
    )


def test_an_empty_file_and_a_missing_one_are_refused(tmp_path):
    (tmp_path / "empty.mcap").write_bytes(b"")
    for name in ("empty.mcap", "nothing.mcap"):
        with pytest.raises(InputError):
            read_record(tmp_path / name)
