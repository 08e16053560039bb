"""What a first balance of forces names: only what explains a share of what drives, and nothing that a constant could balance."""

from pathlib import Path

import foreign
import numpy as np
import pytest
from foreign import moved, tones
from scipy.signal import lfilter

from rhythmid.commands.model_line import model_lines
from rhythmid.record.load import load
from rhythmid.record.signals import Signals
from rhythmid.start.start import Start, start

TIME = foreign.STEP * np.arange(12_000)
LATE = 0.08  # s
FORCE = tones(1, TIME)
SHORT = FORCE[:4000]


def begun(folder: Path, force: np.ndarray, position: np.ndarray) -> Start:
    np.savez(folder / "run.npz", t=TIME, force=force, x=position)
    return start([folder / "run.npz"])


def labels(found: Start) -> set[str]:
    return {term.label for term in found.nominal.model.terms}


def late(force: np.ndarray, by: float) -> np.ndarray:
    """What acts so much later than it was recorded."""
    steps = round(by / foreign.STEP)
    return np.concatenate([np.full(steps, force[0]), force[: len(force) - steps]])


def test_a_delay_that_explains_much_is_guessed(tmp_path):
    found = begun(tmp_path, FORCE, moved(late(FORCE, LATE), 0.05, 0.5, 6.0)[0])
    assert found.nominal.model.value("input_delay.delay") == pytest.approx(LATE, abs=0.01)
    assert "linear_spring" in labels(found)


def test_a_delay_beyond_the_range_is_not_guessed_to_be_at_its_end(tmp_path):
    found = begun(tmp_path, FORCE, moved(late(FORCE, 0.4), 0.05, 0.5, 6.0)[0])
    assert "input_delay" not in labels(found)


@pytest.mark.parametrize("dry", [0.1, 0.2])
def test_what_dry_friction_leaves_of_one_sine_is_neither_delay_nor_spring(tmp_path, dry):
    force = np.sin(2.0 * np.pi * TIME)
    found = begun(tmp_path, force, 300.0 + moved(force, 0.008, 0.28, 0.0, dry)[0])
    assert labels(found) == {"viscous_damper"}
    assert found.nominal.model.value("viscous_damper.damping") == pytest.approx(0.28, rel=0.6)


@pytest.mark.parametrize("level", [0.3, -2.0])
def test_a_step_that_never_changes_tells_inertia_and_spring_by_where_it_holds_the_machine(tmp_path, level):
    held = np.full(len(TIME), level)
    found = begun(tmp_path, held, moved(held, 0.05, 0.02, 6.0)[0])
    model = found.nominal.model
    assert model.value("inertia.mass") == pytest.approx(0.05, rel=0.05)
    assert model.value("linear_spring.stiffness") == pytest.approx(6.0, rel=0.05)
    assert labels(found) == {"linear_spring", "viscous_damper"}
    assert "never changes: all values are by how far from its zero" in " ".join(found.lines())


def test_a_force_that_explains_nothing_of_the_motion_is_doubted(tmp_path):
    found = begun(tmp_path, FORCE, moved(tones(2, TIME), 0.05, 0.5, 6.0)[0])
    (line,) = (one for one in found.lines() if one.startswith("CHECK inertia"))
    assert "the balance of forces" in line and "put in what is known" in line


def test_of_a_speed_that_never_turns_back_neither_gravity_nor_a_spring_is_guessed(tmp_path):
    volts = np.where(TIME % 1.6 >= 0.8, 8.0, 0.0)
    speed = np.where(TIME < 9.0, moved(volts, 0.05, 0.3, 0.0)[1], 0.0)  # its sensor fails
    np.savez(tmp_path / "run.npz", t=TIME, wheel_speed=speed, motor_voltage=volts)
    assert not labels(start([tmp_path / "run.npz"])) & {"linear_spring", "pendulum_gravity"}


def test_of_a_speed_that_turns_back_a_spring_is_guessed_and_no_gravity(tmp_path):
    np.savez(tmp_path / "run.npz", t=TIME, motor_speed=moved(FORCE, 0.05, 0.3, 6.0)[1], motor_torque=FORCE)
    assert "linear_spring" in labels(start([tmp_path / "run.npz"]))


def test_where_the_balance_would_have_a_negative_damping_a_small_one_is_guessed_and_no_rounding(tmp_path):
    position = moved(FORCE, 0.05, 0.5, 6.0)[0]
    speed = np.gradient(position, foreign.STEP)
    force = 0.05 * np.gradient(speed, foreign.STEP) - 0.1 * speed + 6.0 * position
    found = begun(tmp_path, force, position)
    assert found.nominal.model.value("viscous_damper.damping") > 1e-4
    assert "the balance shows no damping" in found.nominal.reasons["viscous_damper"]


def doubt_of_sign(found: Start) -> bool:
    return any("with scale: -1 for the" in line for line in found.lines())


@pytest.mark.parametrize(
    "stiffness, dry", [(0.0, 0.0), pytest.param(6.0, 0.0, marks=pytest.mark.long), (6.0, 0.3)]
)
def test_an_effort_of_the_opposite_sign_is_told_with_what_the_balance_explains(tmp_path, stiffness, dry):
    x = moved(FORCE, 0.05, 0.3, stiffness, dry)[0]
    right, wrong = begun(tmp_path, FORCE, x), begun(tmp_path, -FORCE, x)
    assert doubt_of_sign(wrong) and not doubt_of_sign(right)
    assert ", scale: -1}" in wrong.signals and ", scale: " not in right.signals
    assert wrong.nominal.model.value("inertia.mass") == right.nominal.model.value("inertia.mass")


def test_check_tells_an_effort_whose_sign_is_not_turned_round(tmp_path):
    x = moved(SHORT, 0.05, 0.3, 6.0)[0]
    np.savez(tmp_path / "run.npz", t=TIME[: len(SHORT)], force=-SHORT, x=x)
    wrong = start([tmp_path / "run.npz"])
    (tmp_path / "model.yaml").write_text(wrong.model)
    for signals, said in ((wrong.signals, False), (wrong.signals.replace(", scale: -1}", "}"), True)):
        record = load(tmp_path / "run.npz", Signals.from_text(signals))
        lines = model_lines(tmp_path / "model.yaml", [record])
        assert any("with scale: -1 for the input" in line for line in lines) == said


@pytest.mark.parametrize(("zero", "stiffness"), [(2.5, 6.0), (-40.0, 6.0), (12.0, 0.0)])
def test_an_input_whose_zero_is_elsewhere_gets_an_offset(tmp_path, zero, stiffness):
    x = moved(SHORT, 0.05, 0.3, stiffness)[0]
    np.savez(
        tmp_path / "run.npz",
        **{"t": TIME[: len(SHORT)], "voltage [V]": 0.02 * SHORT + zero, "angle [rad]": 0.02 * x},
    )
    found = start([tmp_path / "run.npz"])
    read = load(tmp_path / "run.npz", Signals.from_text(found.signals)).input
    assert abs(read.value.mean()) < 0.02 * np.ptp(read.value)
    assert any(line.startswith("CHECK input: it stays within") for line in found.lines())
    if stiffness:
        assert abs(found.nominal.model.value("linear_spring.rest_length")) < 0.02 * np.ptp(x)


@pytest.mark.parametrize(("unit", "by", "level"), [("Nm", 12.0, 0.0), ("V", 0.2, 0.0), ("V", 12.0, 50.0)])
def test_a_load_a_small_mean_and_a_motion_that_is_as_far_off_are_no_offset(tmp_path, unit, by, level):
    x = moved(SHORT, 0.05, 0.3, 6.0 if level else 0.0)[0]
    np.savez(
        tmp_path / "run.npz",
        **{"t": TIME[: len(SHORT)], f"tau [{unit}]": SHORT + by, "angle [rad]": x + level},
    )
    assert "offset:" not in start([tmp_path / "run.npz"]).signals


def test_a_delay_that_a_lag_explains_nearly_as_well_is_not_guessed(tmp_path):
    lagged = lfilter([0.04], [1.0, -0.96], SHORT)
    thrust = np.sign(lagged) * lagged**2
    x = moved(thrust, 0.05, 0.5, 6.0, 0.1)[0]
    np.savez(tmp_path / "run.npz", t=TIME[: len(SHORT)], force=SHORT, x=x)
    assert "input_delay" not in labels(start([tmp_path / "run.npz"]))


def test_an_effort_of_the_opposite_sign_is_told_of_a_pendulum(tmp_path):
    found = pendulum(tmp_path, "angle [rad]", sign=-1.0)
    assert doubt_of_sign(found)
    assert found.nominal.model.value("inertia.mass") == pytest.approx(0.25, rel=0.1)


def test_the_effort_of_a_controller_is_not_taken_for_one_of_the_opposite_sign(tmp_path):
    x, _, torque = foreign.servo(tones(2, TIME, 0.3, 0.2, 1.5))
    pushed = torque + 0.2 * np.std(torque) * np.random.default_rng(0).standard_normal(len(TIME))
    assert not doubt_of_sign(begun(tmp_path, pushed, x))


def pendulum(folder: Path, heading: str, scale: float = 1.0, sign: float = 1.0) -> Start:
    """A pendulum that swings widely and turns over, its angle in another unit where told to."""
    angle, speed = np.zeros(len(TIME)), 0.0
    torque = 6.0 * tones(3, TIME)
    for k in range(len(TIME) - 1):
        speed += foreign.STEP * (torque[k] - 0.3 * speed - 4.0 * np.sin(angle[k])) / 0.25
        angle[k + 1] = angle[k] + foreign.STEP * speed
    np.savez(folder / "run.npz", **{"t": TIME, "torque": sign * torque, heading: scale * angle})
    return start([folder / "run.npz"])


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_an_angle_in_degrees_without_a_unit_is_told_where_gravity_shows_it(tmp_path, sign):
    found = pendulum(tmp_path, "angle", 180.0 / np.pi, sign)
    (line,) = [line for line in found.lines() if "with the output in degrees (scale: 0.0174532925)" in line]
    assert line.startswith("CHECK output") and doubt_of_sign(found) == (sign < 0.0)
    assert 'column: "angle", unit: "rad", scale: 0.01745329252}' in found.signals
    assert found.nominal.model.value("pendulum_gravity.moment") == pytest.approx(4.0, rel=0.1)


def test_gravity_of_an_angle_without_a_unit_is_told_on_the_screen(tmp_path):
    found = pendulum(tmp_path, "angle")
    assert any("the unit of the angle is not stated, and gravity needs rad" in line for line in found.lines())


@pytest.mark.parametrize(("heading", "scale"), [("angle [rad]", 1.0), ("angle [deg]", 180.0 / np.pi)])
def test_nothing_is_said_of_degrees_where_a_heading_tells_the_unit(tmp_path, heading, scale):
    assert not any("degrees" in line for line in pendulum(tmp_path, heading, scale).lines())


@pytest.mark.parametrize("stiffness", [0.0, 6.0])
def test_a_spring_is_guessed_only_where_dry_friction_does_not_explain_it(tmp_path, stiffness):
    # driven against friction, the machine lingers where it arrives: high after it rose, low after it fell, as if a spring held it there
    force = moved(np.where(TIME % 3.0 < 1.5, 1.0, -1.0), 0.02, 0.3, 0.0)[1]
    position, speed = np.cumsum(force) * foreign.STEP, force
    acceleration = np.gradient(speed, foreign.STEP)
    drive = 0.05 * acceleration + 0.1 * speed + stiffness * position + 1.0 * np.sign(speed)
    assert ("linear_spring" in labels(begun(tmp_path, drive, position))) is bool(stiffness)


def test_dry_friction_of_one_direction_is_no_constant_force_of_the_nominal_model(tmp_path):
    force = np.where(TIME % 3.0 >= 1.0, 2.0 + np.sin(2.0 * TIME), 0.3)  # it rests in between, held by 0.6
    speed = moved(force, 0.05, 0.2, 0.0, 0.6)[1]
    assert speed.min() > -1e-3
    np.savez(tmp_path / "run.npz", t=TIME, wheel_speed=speed, motor_torque=force)
    found = start([tmp_path / "run.npz"])
    assert labels(found) == {"viscous_damper"}
    assert found.nominal.model.value("inertia.mass") == pytest.approx(0.05, rel=0.3)
    assert found.nominal.model.value("viscous_damper.damping") == pytest.approx(0.2, rel=0.3)
    (remark,) = found.nominal.remarks
    assert "against the motion is needed for the balance" in remark


def test_a_weight_that_is_moved_up_and_down_is_a_constant_force_of_the_nominal_model(tmp_path):
    force = 3.0 * np.sin(2.0 * TIME)
    found = begun(tmp_path, force + 5.0, moved(force, 0.05, 0.3, 0.0, 0.2)[0])
    assert "constant_force" in labels(found)
    assert found.nominal.model.value("constant_force.force") == pytest.approx(-5.0, rel=0.1)


def test_a_constant_force_is_estimated_beside_the_dry_friction_that_prevails_in_one_direction(tmp_path):
    force = np.where(TIME % 4.0 < 3.0, 9.0 + np.sin(5.0 * TIME), -5.0)  # mostly forwards
    found = begun(tmp_path, force + 4.0, moved(force, 0.5, 0.8, 0.0, 4.0)[0])
    assert found.nominal.model.value("constant_force.force") == pytest.approx(-4.0, abs=0.4)
    assert found.nominal.model.value("inertia.mass") == pytest.approx(0.5, rel=0.2)
    (remark,) = found.nominal.remarks
    assert remark.startswith("No dry friction: beside the constant part ")


def test_of_a_motion_in_one_direction_friction_and_no_constant_force_is_needed(tmp_path):
    """It rests without a drive, from where a constant force would drive it back."""
    pushed = np.where((TIME > 2.0) & (TIME < 8.0), 9.0 + np.sin(5.0 * TIME), 0.0)
    found = begun(tmp_path, pushed, moved(pushed, 0.5, 5.0, 0.0, 7.0)[0])
    assert labels(found) == {"viscous_damper"}


def test_no_spring_is_guessed_where_nothing_drives_a_machine_that_never_comes_back(tmp_path):
    speed = np.where(TIME < 1.0, 20.0 * TIME, 20.0 * np.exp(-0.4 * (TIME - 1.0)))
    np.savez(tmp_path / "run.npz", t=TIME, position=np.cumsum(speed) * foreign.STEP)
    found = start([tmp_path / "run.npz"])
    assert labels(found) == {"viscous_damper"}
    assert "it gains speed until t = " in " ".join(found.lines())


def turning(gravity: float, off_centre: float, friction: float) -> np.ndarray:
    """Measured angle (n,) of a wheel that was spun and is left alone: gravity on it, and a sensor off its centre."""
    angle, speed, found = 0.0, 30.0, []
    for _ in TIME:
        found.append(angle + off_centre * np.sin(angle))
        speed -= foreign.STEP * (gravity * np.sin(angle) + friction * speed)
        angle += foreign.STEP * speed
    return np.array(found)


@pytest.mark.parametrize(
    ("gravity", "off_centre", "named"), [(0.0, 0.03, False), (25.0, 0.0, True), (25.0, 0.02, True)]
)
def test_a_sensor_of_angle_that_is_off_centre_is_no_gravity(tmp_path, gravity, off_centre, named):
    angle = turning(gravity, off_centre, 0.03 if gravity else 0.1)
    np.savez(tmp_path / "run.npz", t=TIME, joint_angle=angle)
    assert ("pendulum_gravity" in labels(start([tmp_path / "run.npz"]))) is named


def test_gravity_of_an_angle_is_not_guessed_where_nothing_drives_a_machine_that_turns_one_way(tmp_path):
    """A weight on a drum turns a frame by less than a turn: its torque is constant."""
    time = np.arange(0.0, 1.2, 0.02)
    pulled, damping = 4.0, 0.3
    angle = pulled / damping * (time - (1.0 - np.exp(-damping * time)) / damping)
    noisy = 1.1 + angle + 1e-3 * np.random.default_rng(2).standard_normal(len(time))
    np.savez(tmp_path / "run.npz", **{"t [s]": time, "angle [rad]": noisy})
    found = start([tmp_path / "run.npz"])
    assert labels(found) == {"constant_force", "viscous_damper"}
    assert found.nominal.model.value("constant_force.force") == pytest.approx(pulled, rel=0.3)


def test_a_drive_that_is_switched_off_where_the_record_ends_is_a_constant_one(tmp_path):
    time = 0.004 * np.arange(5000)
    force = np.where(np.arange(5000) < 4985, 1.0, 0.0)
    decay, own = 0.6, np.sqrt(67.0 - 0.6**2)
    position = 0.5 * (1.0 - np.exp(-decay * time) * (np.cos(own * time) + decay / own * np.sin(own * time)))
    np.savez(tmp_path / "step.npz", t=time, force=force, x=position)
    found = start([tmp_path / "step.npz"])
    assert "linear_spring" in labels(found)
    assert found.nominal.model.value("linear_spring.stiffness") == pytest.approx(2.0, rel=0.02)
    assert found.nominal.model.mass.value == pytest.approx(2.0 / 67.0, rel=0.1)
