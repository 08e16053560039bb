"""Jitter of commands: found where it is, told with its size, and weighed as what a lightly damped machine remembers of it."""

from pathlib import Path

import numpy as np
import pytest
from untidy_logs import ARRIVAL, MACHINES, answered, simulated, written

from rhythmid.identify.identification import Identification
from rhythmid.identify.identify import identify
from rhythmid.identify.noise import burg, estimate_noise
from rhythmid.model import Model
from rhythmid.record.read import read_record

JOINT = MACHINES["joint_fast_commands"]
TRUE = {"linear_spring.stiffness": 4.0, "viscous_damper.damping": 0.012}
TOLD = "single commands act earlier or later"


def files(folder: Path, kind: str, friction: float = 0.0, seed: int = 3) -> tuple[Path, Path]:
    return written(folder / kind, JOINT, simulated(JOINT, friction, seed, kind))


def identified(signals: Path, model: Path) -> Identification:
    return identify(read_record(signals), Model.load(model))


def test_commands_that_arrive_late_at_random_are_told_and_the_intervals_hold_the_truth(tmp_path):
    found = identified(*files(tmp_path, "command_jitter"))
    jitter = found.quality["command_jitter"]
    true = float(np.ptp(ARRIVAL)) / np.sqrt(12.0)
    assert abs(jitter["value"] - true) < 3.0 * jitter["std"] < 0.3 * true and jitter["unit"] == "s"
    assert sum(TOLD in note for note in found.notes) == 1
    for name, value in TRUE.items():
        estimate = found.parameters[name]
        assert abs(estimate.value - value) < 3.0 * estimate.std < 0.03 * value, name


@pytest.mark.parametrize(("kind", "friction"), [("clean", 0.0), ("clean", 0.04)])
def test_commands_in_time_have_no_jitter_whether_the_model_is_right_or_not(tmp_path, kind, friction):
    found = identified(*files(tmp_path, kind, friction))
    assert found.quality["command_jitter"]["value"] is None
    assert not any(TOLD in note for note in found.notes)


def test_a_lightly_damped_joint_stays_consistent_while_its_commands_jitter(tmp_path):
    verdict, _ = answered(*files(tmp_path, "command_jitter", seed=1), None)
    assert verdict == "consistent"


def test_the_colour_of_what_a_lightly_damped_machine_remembers_is_whitened():
    """A resonance at 2 Hz with a decay of 2 s, in stretches of 10 s at 100 Hz."""
    radius, angle = np.exp(-0.005), 2.0 * np.pi * 0.02
    a, b = 2.0 * radius * np.cos(angle), -(radius**2)
    rng = np.random.default_rng(1)
    shock = rng.standard_normal(21_000)
    value = np.zeros(len(shock))
    for k in range(2, len(value)):
        value[k] = a * value[k - 1] + b * value[k - 2] + shock[k]
    stretches = np.split(value[1000:], 20)
    noise = burg(stretches)
    assert noise.std == pytest.approx(1.0, rel=0.03)
    np.testing.assert_allclose(noise.coefficients[:2], [a, b], atol=0.03)
    assert estimate_noise(stretches).std > 1.3  # what sample covariances make of it
