"""Numbers that stand for "nothing measured" are missing samples; no motion, command or impact is taken for one."""

import numpy as np
import pytest

from rhythmid.record.cleaning import cleaned
from rhythmid.record.inventory import inventory
from rhythmid.record.placeholder import is_code, placeholder_of, without_placeholders
from rhythmid.record.read import read_record
from rhythmid.record.signals import Signals

COUNT = 2000
TIME = 0.002 * np.arange(COUNT)
NOISE = np.random.default_rng(4).normal(0.0, 1e-3, COUNT)
SWING = np.sin(5.0 * TIME) + NOISE
SIGNALS = "time: {column: t}\noutput: {column: q, unit: rad}\ninput: {column: tau, unit: N*m}\n"


def marked(number: float, where: slice, value=SWING):
    made = value.copy()
    made[where] = number
    return made


def written(path, number: float, where: slice):
    columns = [
        TIME,
        marked(number, where),
        marked(number, where, np.cos(5.0 * TIME)),
        marked(number, where, 0.0 * TIME),
    ]
    np.savetxt(path, np.column_stack(columns), delimiter=",", header="t,q,tau,off", comments="")
    return path


@pytest.mark.parametrize(
    "number", [-1e6, 9999.0, -999.0, 65535.0, -32768.0, 1e10, np.finfo(np.float32).max, -17453.29252]
)
@pytest.mark.parametrize("where", [slice(0, 104), slice(700, 720), slice(1900, None), slice(0, None, 7)])
def test_a_repeated_number_far_beyond_all_others_is_a_placeholder(number, where):
    found = placeholder_of(marked(number, where))
    assert found is not None and found.values == (number,)
    np.testing.assert_array_equal(np.flatnonzero(found.where), np.arange(COUNT)[where])


def test_several_numbers_may_stand_for_nothing():
    found = placeholder_of(marked(-1e6, slice(0, 9), marked(65535.0, slice(500, 520))))
    assert found is not None and set(found.values) == {-1e6, 65535.0} and found.count == 29


RECORDS = {
    "clean": SWING,
    "sticking": np.round(np.clip(3.0 * np.sin(5.0 * TIME), -1.0, 1.0), 2),
    "stepped command": np.where(TIME > 1.0, 10000.0, 0.0),
    "staircase": np.floor(4.0 * TIME / TIME[-1]) ** 9,
    "jump with noise": SWING + np.where(TIME > 1.0, 9999.0, 0.0),
    "saturated at the end of the word": np.clip(np.round(1e5 * np.sin(5.0 * TIME)), -32768, 32767),
    "impact that saturates": np.clip(
        NOISE * 1e3 + 4e4 * np.exp(-(((TIME - 2.0) / 0.004) ** 2)), -32768, 32767
    ),
    "pulse of twenty times the rest": NOISE + np.where(np.abs(TIME - 2.0) < 0.01, 0.1234, 0.0),
    "pulse of a command over a dither": marked(1000.0, slice(900, 950), 5.0 * SWING),
    "outlier that a logger repeats": marked(-6174.11476, slice(900, 903)),
    "single outlier": marked(9999.0, slice(900, 901)),
    "counter that overflows": np.arange(63536.0, 63536.0 + COUNT) % 65536.0,
    "quadratic run-away": TIME**9,
}


@pytest.mark.parametrize("name", RECORDS)
def test_what_a_machine_did_is_no_placeholder(name):
    assert placeholder_of(RECORDS[name]) is None


def test_codes_are_nines_powers_of_ten_and_ends_of_words():
    assert all(map(is_code, (999.0, -9999.0, 1e6, 32767.0, 2.0**31, 2.0**32 - 1.0, 1e30)))
    assert not any(map(is_code, (0.0, 99.0, 1000.0, 1023.0, 4096.0, 9998.0, 99999.5)))


@pytest.mark.parametrize("where", [slice(0, 104), slice(700, 760)])
def test_placeholders_are_missing_samples_and_the_channel_says_how_many_and_why(tmp_path, where):
    path = written(tmp_path / "run.csv", -1e6, where)
    record = read_record(path, Signals.from_text(SIGNALS))
    count = len(range(COUNT)[where])
    for role in ("output", "input"):
        quality = record.quality.channels[role]
        assert (quality.placeholders, quality.placeholder, quality.nan) == (count, "-1000000", 0)
        (said,) = [line for line in quality.complaints() if "-1000000" in line]
        assert said.startswith(f"{count} samples hold -1000000") and "count as missing" in said
    (note,) = cleaned(record).words[:1]
    assert (
        note.startswith(f"input and output: {count} samples hold exactly -1000000, far beyond")
        and "left out" in note
    )
    assert len(record.output) == COUNT - count and np.abs(record.output.value).max() < 2.0


def test_a_guess_is_made_from_what_was_measured_alone(tmp_path):
    found = inventory(written(tmp_path / "run.csv", -1e6, slice(0, 104)))
    assert {one.column: round(float(np.nanmax(np.abs(one.value))), 1) for one in found.recorded} == {
        "q": 1.0,
        "tau": 1.0,
    }
    assert "off: never changes" in found.left_out


def test_columns_of_an_array_have_their_own_placeholders_and_single_numbers_have_none():
    array = np.column_stack([SWING, marked(9999.0, slice(5, 40))])
    told, found = without_placeholders({"q": array, "dt": np.array(0.002), "mass": np.array([9999.0])})
    assert list(found) == ["q[1]"] and found["q[1]"].count == 35
    assert np.isnan(told["q"][5:40, 1]).all() and np.isfinite(told["q"][:, 0]).all() and told["dt"] == 0.002
