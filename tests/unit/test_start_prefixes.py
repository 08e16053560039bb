"""Sides that are glued before a name, as mobile robots' logs have them: `Rspeed`, `LControl`, `leftSpeed`, `FLpos`."""

from pathlib import Path

import foreign
import numpy as np
import pytest
from foreign import moved, roles_of, tones

from rhythmid.start.start import guess

TIME = np.arange(8000) * foreign.STEP
FORCE, OTHER = tones(1, TIME), tones(9, TIME)
V, OTHER_V = moved(FORCE, 0.05, 0.3, 6.0)[1], 0.5 * moved(OTHER, 0.05, 0.3, 6.0)[1]


def table(folder: Path, *names: str) -> Path:
    """A table of the speeds of two sides, and of what drives each."""
    np.savez(folder / "run.npz", t=TIME, **dict(zip(names, (V, OTHER_V, FORCE, OTHER), strict=True)))
    return folder / "run.npz"


@pytest.mark.parametrize(
    "names",
    [
        ("Rspeed", "Lspeed", "RControl", "LControl"),
        ("RSpeed", "LSpeed", "RPwm", "LPwm"),
        ("rspeed", "lspeed", "rpwm", "lpwm"),
        ("rightSpeed", "leftSpeed", "rightPwm", "leftPwm"),
        ("RightWheelSpeed", "LeftWheelSpeed", "RightDuty", "LeftDuty"),
        ("RRspeed", "FLspeed", "RRpwm", "FLpwm"),
        ("FR_speed", "BL_speed", "FR_pwm", "BL_pwm"),
    ],
)
def test_a_side_before_a_known_word_is_a_side(tmp_path, names):
    roles = guess(table(tmp_path, *names)).roles
    assert str(roles.choices["output"].recorded) == names[0] and roles.output_kind == "velocity"
    assert str(roles.choices["input"].recorded) == names[2] and roles.input_kind == "force"


def test_the_columns_of_a_side_need_no_partners_each(tmp_path):
    np.savez(tmp_path / "run.npz", t=TIME, RSpeed=V, RPwm=FORCE, Lspeed=OTHER_V)
    assert roles_of(tmp_path / "run.npz") == {"output": "RSpeed", "input": "RPwm"}


def test_a_letter_before_a_known_word_is_no_side_where_the_other_side_is_missing(tmp_path):
    np.savez(tmp_path / "run.npz", t=TIME, rspeed=V, force=FORCE)
    assert not guess(tmp_path / "run.npz").roles.joint.name.startswith("right")


def test_words_that_merely_begin_with_such_a_letter_are_left_whole(tmp_path):
    np.savez(tmp_path / "run.npz", t=TIME, length=V, rotation=OTHER_V, load=FORCE)
    assert all(one.recorded.side == "" for one in guess(tmp_path / "run.npz").roles.choices.values())
