"""Damaged stamps: duplicates, gaps, disorder, other clocks are told, and no sample is given another's time."""

import numpy as np
import pytest

from rhythmid.errors import InputError
from rhythmid.record.bag_writer import write_bag
from rhythmid.record.messages import Messages
from rhythmid.record.read import read_record

N = 400
STAMPS = np.arange(N, dtype=np.int64) * 1_000_000
VALUES = np.random.default_rng(7).standard_normal(N)
COMMAND = Messages(STAMPS, effort=VALUES)


def stamped(tmp_path, stamps, values=None, received=None, name="bag"):
    values = VALUES[: len(stamps)] if values is None else values
    output = Messages(np.asarray(stamps), position=np.asarray(values), receive_ns=received)
    return write_bag(tmp_path / name, {"/hopper/excitation": COMMAND, "/hopper/joint_states": output})


def test_duplicates_are_dropped_and_counted(tmp_path):
    twice = np.sort(np.concatenate([STAMPS, STAMPS[100:150]]))
    record = read_record(stamped(tmp_path, twice, VALUES[np.searchsorted(STAMPS, twice)]))
    np.testing.assert_array_equal(record.output.value, VALUES)
    assert record.quality.duplicates == 50 and record.quality.channels["output"].conflicts == 0


def test_a_few_duplicates_with_other_values_are_told(tmp_path):
    twice = np.sort(np.concatenate([STAMPS, STAMPS[[7, 70]]]))
    values = VALUES[np.searchsorted(STAMPS, twice)]
    values[[8, 72]] += 1.0
    record = read_record(stamped(tmp_path, twice, values))
    assert record.quality.channels["output"].conflicts == 2
    np.testing.assert_array_equal(record.output.value, VALUES)  # the first of them counts


def test_gaps_are_counted_and_marked_as_not_valid(tmp_path):
    kept = np.ones(N, bool)
    kept[100:120] = kept[300] = False
    record = read_record(stamped(tmp_path, STAMPS[kept], VALUES[kept]))
    timing = record.quality.channels["output"].timing
    assert (timing.gaps, timing.lost, timing.longest_gap) == (2, 21, pytest.approx(0.021))
    uniform = record.uniform()
    assert not uniform.valid[100:120].any() and uniform.valid[kept].all()
    np.testing.assert_array_equal(uniform.output[kept], VALUES[kept])


def test_messages_that_overtook_one_another_are_put_in_order(tmp_path):
    order = np.arange(N)
    order[50], order[52] = 52, 50
    path = stamped(tmp_path, STAMPS[order], VALUES[order], received=STAMPS + 500_000)
    record = read_record(path)
    np.testing.assert_array_equal(record.output.value, VALUES)
    assert record.quality.channels["output"].timing.late == 2


def test_irregular_stamps_keep_their_times(tmp_path):
    stamps = STAMPS + np.random.default_rng(1).integers(0, 400_000, N)
    record = read_record(stamped(tmp_path, stamps))
    np.testing.assert_allclose(record.output.time, stamps * 1e-9, atol=1e-12)
    jitter = record.quality.channels["output"].timing.jitter_std
    assert jitter == pytest.approx(np.sqrt(2.0 / 12.0) * 4e-4, rel=0.1)


def test_stamps_of_another_clock_are_told_where_receipt_shows_it(tmp_path):
    ahead = STAMPS + 2_000_000_000  # two seconds ahead, and recorded for five
    long = {
        "/hopper/excitation": Messages(np.arange(5000) * 1_000_000, effort=np.arange(5000) % 7.0),
        "/hopper/joint_states": Messages(ahead, position=VALUES, receive_ns=STAMPS + 600_000),
    }
    record = read_record(write_bag(tmp_path / "bag", long))
    (note,) = record.quality.notes
    assert "stamps of different clocks" in note and "output -1.9994 s" in note
    (tmp_path / "signals.yaml").write_text(
        "time: receive\ninput: {topic: /hopper/excitation, field: 'effort[0]'}\n"
        "output: {topic: /hopper/joint_states, field: 'position[0]'}\n"
    )
    mended = read_record(tmp_path / "bag", tmp_path / "signals.yaml")
    assert mended.quality.notes == () and mended.output.time[0] == pytest.approx(6e-4)


def test_stamps_that_are_all_zero_are_refused_with_what_to_do(tmp_path):
    with pytest.raises(InputError, match="all 400 samples have the same time, 0 s; use  time: receive"):
        read_record(stamped(tmp_path, 0 * STAMPS, received=STAMPS))


OUTPUT = "output: {topic: /hopper/joint_states, field: 'position[0]'}\n"


def test_a_channel_may_have_times_of_its_own_and_what_is_assumed_is_told(tmp_path):
    path = write_bag(
        tmp_path / "bag",
        {
            "/hopper/excitation": Messages(0 * STAMPS, effort=VALUES, receive_ns=STAMPS + 300_000),
            "/hopper/joint_states": Messages(STAMPS, position=VALUES, receive_ns=STAMPS + 500_000),
        },
    )
    own = tmp_path / "signals.yaml"
    own.write_text("input: {topic: /hopper/excitation, field: 'effort[0]', time: receive}\n" + OUTPUT)
    record = read_record(path, own)
    assert record.input is not None
    np.testing.assert_allclose(record.input.time, 3e-4 + 1e-9 * STAMPS, atol=1e-12)
    np.testing.assert_allclose(record.output.time, 1e-9 * STAMPS, atol=1e-12)
    (note,) = record.quality.notes
    assert (
        note.startswith("assumed: input (time of receipt) and output (stamps) share one clock")
        and "0.5 ms" in note
    )


@pytest.mark.parametrize(
    ("time", "words"),
    [
        ("recieve", "signals.yaml:1: input.time: 'recieve' is none of header, sent, receive"),
        ("{column: t}", "column and sample_rate are for tables"),
        ("{rate: 100}", "rate"),
    ],
)
def test_a_wrong_time_of_a_channel_is_told_with_its_place(tmp_path, time, words):
    own = tmp_path / "signals.yaml"
    own.write_text(f"input: {{topic: /hopper/excitation, field: 'effort[0]', time: {time}}}\n" + OUTPUT)
    with pytest.raises(InputError) as told:
        read_record(stamped(tmp_path, STAMPS), own)
    assert words in str(told.value) and "\n" not in str(told.value)
