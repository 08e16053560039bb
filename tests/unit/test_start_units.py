"""Units that nobody tells are marked for a user to check; those that a heading or a message's type tells are not."""

import foreign
import numpy as np
import pytest
from foreign import array, joint_state, moved, tones

from rhythmid.start.start import guess, start

TIME = np.arange(4000) * foreign.STEP
FORCE = tones(1, TIME)
X, V = moved(FORCE, 0.05, 0.1, 6.0)


def checked(text: str) -> list[str]:
    """The roles above which a comment on an untold unit stands."""
    lines = text.splitlines()
    doubts = [place for place, line in enumerate(lines) if "CHECK: no unit is stated" in line]
    return [next(line for line in lines[place:] if line[0] != "#").split(":")[0] for place in doubts]


@pytest.mark.parametrize(
    ("names", "roles"),
    [
        (("angle", "current"), ["input", "output"]),
        (("angle [rad]", "current"), ["input"]),
        (("angle [deg]", "current [A]"), []),
        (("pos_mm", "tau"), ["input"]),
    ],
)
def test_a_unit_of_a_column_that_its_heading_does_not_tell_is_marked(tmp_path, names, roles):
    np.savez(tmp_path / "run.npz", t=TIME, **{names[0]: X, names[1]: FORCE})
    assert checked(guess(tmp_path / "run.npz").signals) == roles


def test_the_only_number_that_was_recorded_is_the_motion_whatever_its_unit(tmp_path):
    text = "\n".join(f"{t:.4f},{np.exp(-0.1 * t) * np.cos(5.0 * t):.5f}" for t in TIME[::4])
    (tmp_path / "decay.csv").write_text(f"time (s),sensor (V)\n{text}\n")
    signals = guess(tmp_path / "decay.csv").signals
    assert 'output: {column: "sensor (V)"' in signals and "input: none" in signals
    assert "CHECK: its unit is none of a motion: set kind, unit and scale" in signals


def test_messages_with_units_of_their_own_are_not_marked(tmp_path):
    now = 1.7e9
    states = [(now + t, joint_state(now + t, ["a"], position=[x])) for t, x in zip(TIME, X, strict=True)]
    efforts = [(now + t, joint_state(now + t, ["a"], effort=[f])) for t, f in zip(TIME, FORCE, strict=True)]
    bag = foreign.write(tmp_path / "told", {"/states": states, "/command": efforts})
    assert checked(guess(bag).signals) == []
    numbers = [(now + t, array([f])) for t, f in zip(TIME, FORCE, strict=True)]
    bag = foreign.write(tmp_path / "untold", {"/states": states, "/effort_command": numbers})
    assert checked(guess(bag).signals) == ["input"]


@pytest.mark.parametrize(("scale", "marked"), [(1.0, False), (1e3, True)])
def test_a_unit_of_time_that_only_the_steps_tell_is_marked(tmp_path, scale, marked):
    np.savez(tmp_path / "run.npz", t=scale * TIME, x=X, f=FORCE)
    assert ("no heading gives the unit of the times" in guess(tmp_path / "run.npz").signals) == marked


def test_volts_of_a_position_sensor_are_no_effort_and_its_scale_is_asked_for(tmp_path):
    np.savez(tmp_path / "run.npz", t=TIME, **{"Position [V]": X, "Force [N]": FORCE})
    found = guess(tmp_path / "run.npz")
    assert {role: str(one.recorded) for role, one in found.roles.choices.items()} == {
        "output": "Position [V]",
        "input": "Force [N]",
    }
    assert "CHECK: its heading says V, and m is needed: scale:" in found.signals
    np.savez(tmp_path / "fed.npz", t=TIME, position=X, **{"motor voltage [V]": FORCE})
    assert str(guess(tmp_path / "fed.npz").roles.choices["input"].recorded) == "motor voltage [V]"


CURRENT = FORCE / 0.1  # A, of a motor of 0.1 N m/A


def test_of_commands_in_several_units_the_one_of_the_measured_torque_is_the_input(tmp_path):
    rough = FORCE + 3.0 * tones(7, TIME)  # goes less well with the motion
    asked = {"iq cmd [A]": CURRENT, "torque cmd [Nm]": rough}
    np.savez(tmp_path / "run.npz", t=TIME, **{"angle [rad]": X, "sensor torque [Nm]": FORCE}, **asked)
    begun = start([tmp_path / "run.npz"])
    chosen = {role: str(one.recorded) for role, one in begun.guess.roles.choices.items()}
    assert chosen == {"output": "angle [rad]", "input": "torque cmd [Nm]", "effort": "sensor torque [Nm]"}
    assert begun.nominal.model.units.force == "N*m"
    assert begun.nominal.model.value("inertia.mass") == pytest.approx(0.05, rel=0.05)


def test_beside_a_command_in_another_unit_the_model_is_in_that_of_the_measured_effort(tmp_path):
    columns = {"angle [rad]": X, "iq cmd [A]": CURRENT, "sensor torque [Nm]": FORCE}
    np.savez(tmp_path / "run.npz", t=TIME, **columns)
    begun = start([tmp_path / "run.npz"])
    assert begun.nominal.model.units.force == "N*m"
    assert begun.nominal.model.value("inertia.mass") == pytest.approx(0.05, rel=0.05)
    (doubt,) = [line for line in begun.lines() if line.startswith("CHECK input")]
    assert "it is in A, the measured effort and the model in N*m: give it the scale" in doubt


def test_a_command_and_an_effort_of_one_unit_are_not_doubted(tmp_path):
    columns = {"angle [rad]": X, "tau_cmd": FORCE, "torque [Nm]": FORCE + 0.1 * V}
    np.savez(tmp_path / "run.npz", t=TIME, **columns)
    assert not any(line.startswith("CHECK input") for line in start([tmp_path / "run.npz"]).lines())
