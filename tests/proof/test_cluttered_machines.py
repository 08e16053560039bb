"""The bench's simulated machines: what they log is read, and hides what the bench says that it hides."""

import numpy as np
import pytest
from cluttered_machines import MACHINES, RATE, STEP, axis, cluttered_cases, quiet_axis
from scipy.signal import butter, sosfiltfilt

from rhythmid.identify.drive import controlled
from rhythmid.model import Model
from rhythmid.record.read import load_records

CUT = 40.0  # Hz


@pytest.mark.parametrize("name", [f"cluttered {machine[0]}" for machine in MACHINES])
def test_a_machine_s_logs_are_read_and_its_nominal_model_fits_to_them(tmp_path, name):
    (case,) = cluttered_cases(tmp_path, lambda other: other == name)
    model = Model.load(case.model)
    assert model.free
    records = load_records([*case.train, *case.holdout])
    assert len(records) == 3
    for record in records:
        assert record.output.unit == model.units.position and np.std(record.output.value) > 0
        steps = np.diff(record.output.time)
        assert 0.01 < np.std(steps) / np.mean(steps) < 0.2  # stamps jitter
        assert (record.input_kind == "reference") == controlled(model)
    assert not np.array_equal(records[0].output.value, records[2].output.value)


def friction_level(channels: dict[str, np.ndarray]) -> float:
    """Coulomb level [N] of the axis by inverse dynamics over its noise-free motion, mass and damping known."""
    x, force = channels["x"], channels["force"]
    v = np.gradient(x, STEP)
    a = np.gradient(v, STEP)
    moving = np.abs(v) > 0.05
    low = butter(2, 2 * CUT * STEP, output="sos")
    residual = sosfiltfilt(low, force - 1.7 * a - 12.0 * v)[moving]
    return float(np.median(residual * np.sign(v[moving])))


def test_the_axis_rubs_by_what_the_bench_says_and_the_quiet_one_does_not():
    channels, noise = axis(1)
    assert friction_level(channels) == pytest.approx(4.0, rel=0.1)
    assert noise["force"] < 0.02 * np.std(channels["force"])
    quiet, noise = quiet_axis(1)
    assert abs(friction_level(quiet)) < 0.1
    assert noise["force"] == pytest.approx(0.05 * np.std(quiet["force"]))


def test_logs_are_taken_at_the_stated_rate(tmp_path):
    (case,) = cluttered_cases(tmp_path, lambda name: name == "cluttered axis null")
    (record, *_) = load_records(case.train)
    assert 1.0 / record.output.period == pytest.approx(RATE, rel=0.01)
