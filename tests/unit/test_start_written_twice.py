"""A number that was recorded in two units is one number; an effort is not left out for its name; a speed without a name is found."""

import numpy as np
import pytest

from rhythmid.start.start import guess, start

STEP = 0.005
TIME = STEP * np.arange(3000)
WAVE = np.sum([np.sin(2 * np.pi * f * TIME + f) for f in (0.3, 0.7, 1.1, 1.9)], axis=0)


def motion(effort: np.ndarray, inertia: float = 0.1, damping: float = 0.5) -> tuple[np.ndarray, np.ndarray]:
    """Position and velocity of an inertia with a damper."""
    velocity = np.zeros(len(effort))
    for k in range(len(effort) - 1):
        velocity[k + 1] = velocity[k] + STEP * (effort[k] - damping * velocity[k]) / inertia
    return np.cumsum(velocity) * STEP, velocity


def chosen(found) -> dict[str, str]:
    """The chosen numbers by role."""
    return {role: str(one.recorded) for role, one in found.roles.choices.items()}


def test_of_an_angle_in_counts_and_in_radians_the_one_in_radians_is_the_motion(tmp_path):
    position, velocity = motion(WAVE)
    ticks = np.rint(2048 - 651.9 * position)
    columns = {
        "present_position_tick": ticks,
        "present_position_rad": -(ticks - 2048) / 651.9,
        "present_velocity_raw": np.rint(velocity / 0.024),
        "present_velocity_rad_s": np.rint(velocity / 0.024) * 0.024,
        "torque [Nm]": WAVE,
    }
    np.savez(tmp_path / "run.npz", t=TIME, **columns)
    found = guess(tmp_path / "run.npz")
    assert chosen(found) == {
        "output": "present_position_rad",
        "velocity": "present_velocity_rad_s",
        "input": "torque [Nm]",
    }
    assert (
        "present_position_tick is present_position_rad in another unit, and is left out" in found.roles.notes
    )


def test_a_duty_in_per_cent_and_in_counts_is_not_a_command_and_its_measurement(tmp_path):
    position, _ = motion(WAVE)
    counts = np.rint(100.0 * WAVE)
    np.savez(
        tmp_path / "run.npz",
        t=TIME,
        **{"angle [rad]": position, "pwm_percent": 0.113 * counts, "present_pwm": counts},
    )
    assert chosen(guess(tmp_path / "run.npz")) == {"output": "angle [rad]", "input": "pwm_percent"}


def test_two_sensors_of_one_motion_in_two_units_are_not_one_number(tmp_path):
    rng = np.random.default_rng(3)
    position, _ = motion(WAVE)
    other = 57.3 * position + 0.2 * rng.standard_normal(len(TIME))
    np.savez(
        tmp_path / "run.npz",
        t=TIME,
        **{"motor_angle": other, "link_angle [rad]": position, "torque [Nm]": WAVE},
    )
    assert not any(
        "in another unit, and is left out" in note for note in guess(tmp_path / "run.npz").roles.notes
    )


@pytest.mark.parametrize(
    ("rough", "unit", "roles"),
    [(1.0, "1", {"input": "pwm"}), (0.0, "A", {"input": "pwm", "effort": "current [A]"})],
)
def test_a_command_in_another_unit_comes_before_a_current_that_tells_less_of_the_motion(
    tmp_path, rough, unit, roles
):
    rng = np.random.default_rng(4)
    position, _ = motion(WAVE)
    current = 2.0 * WAVE + rough * np.repeat(rng.standard_normal(len(TIME) // 20), 20)
    np.savez(tmp_path / "run.npz", t=TIME, **{"angle [rad]": position, "pwm": WAVE, "current [A]": current})
    begun = start([tmp_path / "run.npz"])
    assert chosen(begun.guess) == {"output": "angle [rad]"} | roles
    assert begun.nominal.model.units.force == unit


@pytest.mark.parametrize(
    ("names", "kind"),
    [
        (("number", "input"), "velocity"), (("y", "u"), "velocity"),
        (("position", "input"), "position"), (("x", "u"), "position"),
    ],
)  # fmt: skip
def test_a_number_without_a_name_that_follows_as_a_speed_does_is_a_speed(tmp_path, names, kind):
    steps = np.repeat(np.random.default_rng(5).uniform(1.0, 5.0, 30), 100)
    _, velocity = motion(steps)
    noisy = velocity + 0.01 * np.random.default_rng(6).standard_normal(len(TIME))
    np.savez(tmp_path / "run.npz", t=TIME, **{names[0]: noisy, names[1]: steps})
    begun = start([tmp_path / "run.npz"])
    assert begun.guess.roles.output_kind == kind
    labels = [term.label for term in begun.nominal.model.terms]
    assert ("linear_spring" in labels) == (kind == "position")
    if kind == "velocity":
        assert begun.nominal.model.value("inertia.mass") == pytest.approx(0.1, rel=0.1)
        assert "no name says whether it is a speed or a position" in begun.signals


def test_a_number_without_a_name_whose_spring_needs_an_inertia_is_a_position(tmp_path):
    position, velocity = np.zeros(len(TIME)), 0.0
    for k in range(len(TIME) - 1):
        velocity += STEP * (WAVE[k] - 0.3 * velocity - 8.0 * position[k]) / 0.1
        position[k + 1] = position[k] + STEP * velocity
    np.savez(tmp_path / "run.npz", t=TIME, number=position, input=WAVE)
    assert start([tmp_path / "run.npz"]).guess.roles.output_kind == "position"
