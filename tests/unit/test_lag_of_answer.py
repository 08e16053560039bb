"""The lag of an answer after its command is that at which both agree best, whatever the record has besides one ramp."""

import numpy as np
import pytest

from rhythmid.record.inventory import Recorded
from rhythmid.start.relation import follows
from rhythmid.start.start import start

TIME = 0.02 * np.arange(1500)
RAMP = 25.0 + 25.0 * np.clip((TIME - 12.0) / 3.0, 0.0, 1.0)


def late(by: float) -> np.ndarray:
    return 1.07 * np.interp(TIME - by, TIME, RAMP) - 6.0


@pytest.mark.parametrize("by", [0.0, 0.18, 0.4, -0.1])
def test_the_lag_of_one_ramp_is_not_taken_for_none(by):
    noise = 0.05 * np.random.default_rng(0).standard_normal(len(TIME))
    told = follows(Recorded("asked", TIME, RAMP), Recorded("measured", TIME, late(by) + noise))
    assert told.lag == pytest.approx(by, abs=0.021) and told.correlation > 0.98


def test_init_states_the_lag_once(tmp_path):
    np.savez(tmp_path / "run.npz", t=TIME, pid_out=RAMP, wheel_speed=late(0.18))
    lines = [line for line in start([tmp_path / "run.npz"]).lines() if line.startswith("input: ")]
    assert len(lines) == 1 and lines[0].count("follows it") == 1 and "180 ms later" in lines[0]
