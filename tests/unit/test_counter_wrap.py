"""Times of counters that begin again at zero go on; what begins anew for another reason is left as it is."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rhythmid.record.counter_wrap import unwrapped
from rhythmid.record.inventory import inventory


@given(
    st.integers(1, 3000), st.sampled_from([(16, 1.0), (24, 1.0), (32, 1.0), (32, 1e-3), (32, 1e-6)]), st.integers(10, 900),
    st.lists(st.integers(1, 9), min_size=30, max_size=60),
)  # fmt: skip
def test_a_counter_of_16_24_or_32_bits_goes_on_over_its_end(usual, counter, before, lost):
    bits, unit = counter
    steps = np.full(2 * len(lost), usual)
    steps[1::2] *= np.array(lost) > 8  # two samples with one stamp
    steps[::7] *= 2  # a lost sample
    true = 2**bits - min(before, len(lost)) * usual + np.cumsum(steps)
    counted = true % 2**bits
    found, said = unwrapped(counted * unit)
    assert said is not None and f"{bits} bits" in said
    np.testing.assert_allclose(np.diff(found), np.diff(true) * unit, atol=1e-6 * unit * 2**bits / 1e3)


@pytest.mark.parametrize(
    "values",
    [
        np.arange(50.0), np.tile(np.arange(50.0), 2), np.r_[np.arange(50.0), 20.0, np.arange(51.0, 80.0)],
        np.r_[np.arange(65400.0, 65536.0), np.arange(5000.0, 5100.0)], np.full(9, 3.0), np.array(["a", "b", "c"]),
        -np.arange(70000.0),
    ],
)  # fmt: skip
def test_what_is_no_counter_at_its_end_is_left_as_it_is(values):
    assert unwrapped(values)[0] is values and unwrapped(values)[1] is None


def test_a_counter_with_a_sign_and_one_of_which_rows_are_lost_at_its_end_go_on():
    true = 2.0**31 - 50_000.0 + 5_000.0 * np.arange(60)
    found, said = unwrapped((true + 2.0**31) % 2.0**32 - 2.0**31)
    np.testing.assert_array_equal(np.diff(found), 5_000.0)
    assert said is not None and said.startswith("begins anew once")
    kept = np.r_[0:8, 40:60]
    np.testing.assert_array_equal(
        np.diff(unwrapped(true[kept] * 2.0 % 2.0**32)[0]), 2.0 * np.diff(true[kept])
    )


def test_a_log_of_micros_over_its_end_is_one_record(tmp_path):
    micros = (2**32 - 400_000 + 10_000 * np.arange(200)) % 2**32
    rows = [f"{t},{np.sin(0.3 * k):.4f}" for k, t in enumerate(micros)]
    (tmp_path / "run.csv").write_text("micros,q\n".replace("micros", "time_us") + "\n".join(rows) + "\n")
    found = inventory(tmp_path / "run.csv").recorded
    assert [one.column for one in found] == ["q"]
    np.testing.assert_allclose(np.diff(found[0].time), 0.01)
