"""What drives a machine, of channels that all go with its motion: voltages, copies of the output, and motions that drive others."""

import foreign
import numpy as np
import pytest
from foreign import moved, roles_of, tones

from rhythmid.errors import InputError
from rhythmid.start.start import guess, start

TIME = np.arange(8000) * foreign.STEP
FORCE = tones(1, TIME)
X, V = moved(FORCE, 0.05, 0.1, 6.0)


def test_a_voltage_that_a_controller_made_of_the_position_is_the_input(tmp_path):
    mass, damping, gain, place = 1.2, 9.0, 100.0, 0.2
    time = np.arange(1500) * foreign.STEP
    x = v = 0.0
    cart = np.zeros(len(time))
    for k in range(len(time)):
        cart[k] = x
        v += foreign.STEP * (gain * (place - x) - damping * v) / mass
        x += foreign.STEP * v
    np.savez(tmp_path / "run.npz", t=time, z=cart, v=gain * (place - cart))
    begun = start([tmp_path / "run.npz"])
    assert roles_of(tmp_path / "run.npz") == {"input": "v", "output": "z"}
    assert "CHECK input: it is a copy of the output (correlation -1.00000 at once)" in "\n".join(
        begun.lines()
    )
    model = begun.nominal.model
    assert (
        model.units.force == "V" and model.term("linear_spring") is None and model.term("input_delay") is None
    )
    assert model.value("inertia.mass") == pytest.approx(mass, rel=0.1)
    assert model.value("viscous_damper.damping") == pytest.approx(damping, rel=0.1)


def test_a_v_that_is_the_slope_of_the_position_is_its_velocity(tmp_path):
    np.savez(tmp_path / "run.npz", t=TIME, x=X, v=V, f=FORCE)
    assert roles_of(tmp_path / "run.npz") == {"input": "f", "output": "x", "velocity": "v"}


@pytest.mark.parametrize("rounded", [3, 9])
def test_a_copy_of_the_output_is_no_effort(tmp_path, rounded):
    rng = np.random.default_rng(0)
    millimetres = 1e3 * X + 0.05 * rng.standard_normal(len(X))
    volts = np.round(3.5 + 0.075 * millimetres, rounded)
    force = FORCE + 0.3 * rng.standard_normal(len(X))
    np.savez(tmp_path / "run.npz", **{"0": TIME, "1": volts, "2": force, "3": millimetres})
    found = guess(tmp_path / "run.npz")
    assert str(found.roles.choices["input"].recorded) == "2"
    assert "effort" not in found.roles.choices and "reference" not in found.roles.choices
    assert any("is a copy of the output" in line for line in found.lines())
    assert "CHECK" in found.signals and "is a copy of the output" in found.signals


def test_a_force_that_a_slow_spring_makes_a_copy_of_the_motion_is_kept_and_doubted(tmp_path):
    slow = 0.1 * np.sin(0.5 * TIME)
    np.savez(tmp_path / "run.npz", t=TIME, position=slow, force=30.0 * slow)
    assert roles_of(tmp_path / "run.npz")["input"] == "force"
    assert "CHECK input: it is a copy of the output" in "\n".join(guess(tmp_path / "run.npz").lines())


def test_what_goes_with_the_motion_and_is_left_unused_is_told_where_nothing_drives(tmp_path):
    measured = X + 0.01 * np.std(X) * np.random.default_rng(0).standard_normal(len(X))
    np.savez(tmp_path / "run.npz", t=TIME, angle=measured, fan_speed=FORCE)
    found = guess(tmp_path / "run.npz")
    assert (
        "input: none" in found.signals and "# CHECK: nothing is taken to drive the machine" in found.signals
    )
    told = next(line for line in found.lines() if line.startswith("CHECK nothing is taken to drive"))
    assert "fan_speed (velocity: its name says 'speed'; coherence" in told


def rolling(tilt: np.ndarray) -> np.ndarray:
    """Place of a ball on a beam, which brings it back gently, and is damped; as noisy as a cheap sensor."""
    place, _ = moved(7.0 * np.repeat(tilt, 10), 1.0, 0.6, 4.0)
    return place[::10] + 0.003 * np.random.default_rng(0).standard_normal(len(tilt))


def test_a_motion_that_another_one_drives_is_the_output_however_much_that_one_moves(tmp_path):
    rng = np.random.default_rng(4)
    tilt = np.repeat(rng.uniform(-0.15, 0.15, 80), 50)
    time = 0.01 * np.arange(len(tilt))
    np.savez(tmp_path / "run.npz", t=time, beam_deg=np.degrees(tilt), ball_mm=1e3 * rolling(tilt))
    begun = start([tmp_path / "run.npz"])
    assert roles_of(tmp_path / "run.npz") == {"input": "beam_deg", "output": "ball_mm"}
    assert "CHECK input: a motion, not a force: the model's forces are in rad" in "\n".join(begun.lines())
    assert not begun.guess.roles.rotary and begun.nominal.model.units.force == "rad"
    assert begun.nominal.model.value("inertia.mass") == pytest.approx(1.0 / 7.0, rel=0.5)
    assert roles_of(tmp_path / "run.npz", joint="beam") == {"output": "beam_deg"}


def test_two_motions_of_which_neither_drives_the_other_are_joints(tmp_path):
    rng = np.random.default_rng(0)
    lift, arm = (
        one + 0.01 * np.std(one) * rng.standard_normal(len(one))
        for one in (tones(5, TIME, 1.0, 0.37, 5.3), X)
    )
    np.savez(tmp_path / "run.npz", t=TIME, arm_rad=arm, lift_mm=1e3 * lift)
    assert roles_of(tmp_path / "run.npz") == {"output": "lift_mm"}


def test_a_device_says_less_of_a_quantity_than_a_word_for_it(tmp_path):
    np.savetxt(
        tmp_path / "run.csv",
        np.column_stack([TIME, V, FORCE]),
        delimiter=",",
        header="t,vel encoder,duty",
        comments="",
    )
    begun = start([tmp_path / "run.csv"])
    assert begun.guess.roles.output_kind == "velocity"
    assert begun.nominal.model.units.force == "1"  # a share of full duty


def test_a_second_angle_is_no_effort(tmp_path):
    np.savez(tmp_path / "run.npz", time=TIME, phi=X, psi=0.3 * np.roll(X, 40))
    assert "input" not in roles_of(tmp_path / "run.npz")


def test_a_table_of_another_layout_is_told_as_such_and_no_file_is_named_that_is_not_there(tmp_path):
    np.savez(tmp_path / "a.npz", t=TIME, x=X, f=FORCE)
    np.savez(tmp_path / "b.npz", t=TIME, x=X, u=FORCE)
    with pytest.raises(InputError, match=r"^guessed input: .*b\.npz: has no column 'f'"):
        start([tmp_path / "a.npz", tmp_path / "b.npz"])


def test_a_time_of_another_length_is_told(tmp_path):
    np.savez(tmp_path / "run.npz", t=TIME[:-9], x=X, f=FORCE)
    with pytest.raises(InputError, match="of another length than their 8000 rows: t has 7991 rows"):
        start([tmp_path / "run.npz"])
