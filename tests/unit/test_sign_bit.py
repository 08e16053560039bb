"""Words with a sign bit are recognised by `init` and read as signed numbers; a guess falls on a channel that moves."""

import numpy as np
import pytest
from tables import write_columns

from rhythmid.errors import InputError
from rhythmid.record.read import read_record
from rhythmid.record.sign_bit import sign_bit_of, signed
from rhythmid.record.signals import Signals
from rhythmid.start.start import guess

TIME = 0.1 * np.arange(600)
SPEED = np.round(300.0 * np.cos(0.7 * TIME) + 120.0 * np.cos(1.9 * TIME))
RNG = np.random.default_rng(2)


def words(value: np.ndarray, bit: int) -> np.ndarray:
    return np.where(value < 0.0, 2.0**bit - value, value)


@pytest.mark.parametrize("bit", [10, 15])
def test_a_sign_bit_is_found_and_the_numbers_are_signed(bit):
    told = words(SPEED, bit)
    assert sign_bit_of(told) == bit
    np.testing.assert_array_equal(signed(told, bit), SPEED)


ORDINARY = {
    "signed numbers": SPEED,
    "no integers": words(SPEED, 10) + 0.5,
    "an encoder that passes 2048": 2047.0 + np.round(300.0 * np.sin(0.7 * TIME)),
    "a switch with noise": np.round(500.0 + 3.0 * RNG.normal(size=len(TIME)))
    + 540.0 * (np.sin(0.7 * TIME) > 0.0),
    "a flag": 1024.0 * (np.sin(0.7 * TIME) > 0.0),
    "an encoder that turns": np.round(4096.0 * (0.3 * TIME % 1.0)),
    "noise": RNG.integers(0, 2048, len(TIME)).astype(float),
}


@pytest.mark.parametrize("name", ORDINARY)
def test_ordinary_numbers_have_no_sign_bit(name):
    assert sign_bit_of(ORDINARY[name]) is None


def written(path, resting: bool = True):
    """Two servos: 1 moves; 2 jumps to its end, moves more than 1, and rests there in most of the samples."""
    position = 2000.0 + np.round(np.cumsum(SPEED) * 0.02)
    end = np.minimum(2347.0, 1500.0 + np.round(np.cumsum(np.abs(40.0 * np.sin(0.35 * TIME))) % 3600.0))
    columns = {
        "pos (1)": position,
        "speed (1)": words(SPEED, 15),
        "load (1)": words(np.round(0.1 * np.gradient(SPEED, TIME)), 10),
    }
    if resting:
        columns["pos (2)"] = end
    return write_columns(path, {"time": TIME} | columns)


def test_init_falls_on_the_joint_that_can_be_used_and_says_why_and_marks_sign_bits(tmp_path):
    path = written(tmp_path / "servo.csv")
    found = guess(path)
    assert found.roles.joint.name == "1" and found.roles.choices["output"].recorded.column == "pos (1)"
    told = "\n".join(found.lines())
    assert (
        "joint 1 is taken, because that which moves most cannot be used" in told and "column pos (2)" in told
    )
    assert "bit 15 is their sign" in told and "sign_bit: 15" in found.signals
    record = read_record(path, Signals.from_text(found.signals))
    assert record.velocity is not None and record.velocity.value.min() == SPEED.min()


def test_a_joint_that_was_asked_for_is_refused_with_its_channel_and_the_option_that_changes_it(tmp_path):
    with pytest.raises(InputError, match=r"clipped at 2347.*pos \(2\).*--joint NAME \(1\)"):
        guess(written(tmp_path / "servo.csv"), joint="2")
