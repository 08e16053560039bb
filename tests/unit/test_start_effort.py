"""Of several measured efforts the one that balances the motion drives; a measured effort acts when it is measured."""

from pathlib import Path

import numpy as np

from rhythmid.start.start import start

RNG = np.random.default_rng(2)
STEP = 0.005
TIME = STEP * np.arange(2000)
WAVE = np.sum([np.sin(2 * np.pi * f * TIME + f) for f in (0.3, 0.7, 1.1, 1.9)], axis=0)


def motion(effort: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Position and velocity of 0.1 kg*m^2 with 0.5 N*m*s/rad."""
    velocity = np.zeros(len(effort))
    for k in range(len(effort) - 1):
        velocity[k + 1] = velocity[k] + STEP * (effort[k] - 0.5 * velocity[k]) / 0.1
    return np.cumsum(velocity) * STEP + 1e-5 * RNG.standard_normal(len(effort)), velocity


def log(folder: Path, columns: dict[str, np.ndarray]) -> Path:
    np.savez(folder / "run.npz", **{"time [s]": TIME}, **columns)
    return folder / "run.npz"


def test_the_effort_that_balances_the_motion_comes_before_one_whose_name_is_preferred(tmp_path):
    position, _ = motion(WAVE)
    idle = np.cumsum(RNG.standard_normal(len(TIME)))
    columns = {
        "position [rad]": position,
        "torque command [Nm]": idle - 1.0,
        "joint torque [Nm]": idle + RNG.standard_normal(len(TIME)),
        "motor current [A]": WAVE,
    }
    found = start([log(tmp_path, columns)])
    assert str(found.guess.roles.choices["input"].recorded) == "motor current [A]"
    assert "explains" in found.guess.roles.choices["input"].reason
    assert {str(one) for one in found.guess.roles.choices["input"].others} == {
        "joint torque [Nm]",
        "torque command [Nm]",
    }
    assert found.nominal.model.units.force == "A"
    assert 'column: "motor current [A]"' in found.signals


def test_a_long_delay_is_doubted_of_a_command_and_not_guessed_of_a_measured_current(tmp_path):
    late = np.concatenate([np.zeros(12), WAVE[:-12]])
    position, _ = motion(late)
    asked = start([log(tmp_path, {"position [rad]": position, "torque_cmd [Nm]": WAVE})]).nominal
    assert 0.05 < asked.model.value("input_delay.delay") < 0.07
    assert "look like a delay" in asked.doubts["input_delay"]
    measured = start([log(tmp_path, {"position [rad]": position, "motor current [A]": WAVE})]).nominal
    assert measured.model.term("input_delay") is None


def test_a_part_of_an_effort_that_a_model_computes_drives_only_where_nothing_else_does(tmp_path):
    position, velocity = motion(WAVE)
    parts = {
        "position [rad]": position,
        "gravity torque [Nm]": 2.0 * np.sin(position),
        "coriolis torque [Nm]": 0.1 * velocity,
    }
    whole = start([log(tmp_path, {**parts, "applied torque [Nm]": WAVE})]).guess.roles.choices
    assert str(whole["input"].recorded) == "applied torque [Nm]" and "effort" not in whole
    alone = start([log(tmp_path, parts)]).guess.roles.choices
    assert str(alone["input"].recorded) in parts
