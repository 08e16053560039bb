"""A sample period or rate that stands in words above a table."""

import numpy as np
import pytest

from rhythmid.record.inventory import inventory
from rhythmid.record.stated_above import NAME_OF_PERIOD, NAME_OF_RATE, stated_above


@pytest.mark.parametrize(
    ("line", "told"),
    [
        ("Monday\t12:07:42\tSampling Period : 4  ms\t\tOpen Loop", {NAME_OF_PERIOD: 0.004}),
        ("# sample rate = 1.5 kHz", {NAME_OF_RATE: 1500.0}),
        ("% Sampling interval: 2,5 ms", {NAME_OF_PERIOD: 0.0025}),
        ("Acquisition frequency 200 Hz", {NAME_OF_RATE: 200.0}),
        ("Baud rate: 9600 Hz", {}),
        ("Sample rate: 100", {}),  # of no unit
        ("Sampling Period : 4 m", {}),
        ("Resampling rate: 10 Hz", {}),
    ],
)
def test_a_period_or_rate_is_read_with_its_unit_only(line, told):
    assert stated_above([line]) == pytest.approx(told)


@pytest.mark.parametrize("counter", ["t", "time"])
def test_a_time_that_counts_the_rows_has_the_stated_period(tmp_path, counter):
    table = tmp_path / "run.txt"
    rows = "\n".join(f"{k}\t{np.sin(0.02 * k):.6f}" for k in range(300))
    table.write_text(f"12:07\tSampling Period : 4  ms\n\n{counter}\tangle\n{rows}\n", encoding="utf-8")
    found = inventory(table)
    assert found.clock is not None and (found.clock.column, found.clock.scale) == (
        counter,
        pytest.approx(0.004),
    )


def test_a_table_without_a_time_has_the_stated_rate_and_its_own_time_goes_before(tmp_path):
    table = tmp_path / "run.csv"
    rows = "\n".join(f"{np.sin(0.02 * k):.6f},{np.cos(0.02 * k):.6f}" for k in range(300))
    table.write_text(f"# sample rate: 250 Hz\nangle,torque\n{rows}\n", encoding="utf-8")
    found = inventory(table)
    assert found.clock is not None and (found.clock.kind, found.clock.rate) == ("rate", pytest.approx(250.0))
    rows = "\n".join(f"{0.001 * k:.3f},{np.sin(0.02 * k):.6f}" for k in range(300))
    table.write_text(f"# sample rate: 250 Hz\nt,angle\n{rows}\n", encoding="utf-8")
    found = inventory(table)
    assert found.clock is not None and found.clock.scale == 1.0
