"""Samples that were held back and came in bursts get the times at which they were taken; all others keep theirs."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rhythmid.record.arrival_bursts import LEAST_SAMPLES_IN_BURSTS, without_bursts
from rhythmid.record.read import read_record
from rhythmid.record.record import Channel

PERIOD = 0.005
TAKEN = PERIOD * np.arange(4000)
seeds = st.integers(0, 10_000)


def came(taken, seed, held=0.02):
    """When samples come that are released at random times, `held` [s] apart on average."""
    rng = np.random.default_rng(seed)
    release = np.cumsum(rng.uniform(0.0, 2.0 * held, int(2 * taken[-1] / held) + 10))
    place = np.searchsorted(release, taken)
    return release[place] + 1e-6 * (np.arange(len(taken)) - np.searchsorted(place, place))


def motion(time):
    return np.sin(2 * np.pi * 0.7 * time) + 0.3 * np.sin(2 * np.pi * 1.9 * time)


def one(time, value):
    return {"output": Channel(time, value, "rad")}


@given(seed=seeds)
@settings(max_examples=20, deadline=None)
def test_samples_that_came_in_bursts_get_the_times_at_which_they_were_taken(seed):
    noise = 1e-3 * np.random.default_rng(seed).standard_normal(len(TAKEN))
    found, notes = without_bursts(one(came(TAKEN, seed), motion(TAKEN) + noise))
    error = found["output"].time - TAKEN
    assert np.abs(error).max() < 0.5 * PERIOD
    assert len(notes) == 1 and "came in bursts" in notes[0] and "evenly spaced, every" in notes[0]


def test_channels_that_share_their_times_are_treated_alike():
    time = came(TAKEN, 1)
    steps = np.repeat(np.arange(40.0), 100)  # a command that says nothing of its times by itself
    given_ = {"output": Channel(time, motion(TAKEN), "rad"), "input": Channel(time, steps, "N*m")}
    found, notes = without_bursts(given_)
    assert found["input"].time is found["output"].time and "output and input" in notes[0]


@given(seed=seeds)
@settings(max_examples=20, deadline=None)
def test_neither_slow_writing_nor_a_busy_while_hides_that_samples_came_in_bursts(seed):
    time = came(TAKEN, seed)
    within = np.arange(len(TAKEN)) - np.searchsorted(time, time - 1e-4)  # number of a sample in its burst
    time = time + 0.15 * PERIOD * within  # a serial line takes its time for each
    busy = (TAKEN > 8.0) & (TAKEN < 8.5)
    time[busy] = np.maximum(time[busy], 8.5)
    time = np.maximum.accumulate(time) + 1e-6 * np.arange(len(time))
    found, notes = without_bursts(one(time, motion(TAKEN)))
    assert len(notes) == 1 and np.abs(found["output"].time - TAKEN).max() < PERIOD


@pytest.mark.parametrize("place", [400, 1500, 2000, 3100])
def test_where_one_sample_is_lost_times_are_kept(place):
    time, value = np.delete(came(TAKEN, place), place), np.delete(motion(TAKEN), place)
    channels = one(time, value)
    assert without_bursts(channels) == (channels, ())


@pytest.mark.parametrize("case", ["even", "stamped in bursts", "noise alone", "samples lost", "few"])
def test_all_others_keep_their_times(case):
    time = came(TAKEN, 2)
    rng = np.random.default_rng(2)
    kept = np.ones(len(TAKEN), bool)
    kept[1500:1600] = case != "samples lost"
    channels = {
        "even": one(TAKEN, motion(TAKEN)),
        "stamped in bursts": one(time, motion(time)),
        "noise alone": one(time, rng.standard_normal(len(time))),
        "samples lost": one(time[kept], motion(TAKEN)[kept]),
        "few": one(time[: LEAST_SAMPLES_IN_BURSTS - 1], motion(TAKEN)[: LEAST_SAMPLES_IN_BURSTS - 1]),
    }[case]
    assert without_bursts(channels) == (channels, ())


def test_a_table_that_was_written_in_bursts_says_so_in_its_notes(tmp_path):
    rows = np.column_stack([came(TAKEN, 3), motion(TAKEN)])
    np.savetxt(tmp_path / "log.csv", rows, delimiter=",", header="t,angle", comments="", fmt="%.9f")
    signals = tmp_path / "signals.yaml"
    signals.write_text("time: {column: t}\ntables: {file: log.csv}\noutput: {column: angle, unit: rad}\n")
    record = read_record(signals)
    assert np.ptp(np.diff(record.output.time)) < 1e-9
    assert record.quality is not None and any("came in bursts" in note for note in record.quality.notes)
