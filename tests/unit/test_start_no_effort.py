"""What is no effort: a place of the tool, a counter or a flag, what hardly goes with the output beside a reference; and references that are
followed nearly perfectly, whatever their name."""

from pathlib import Path

import foreign
import numpy as np
import pytest
from foreign import moved, roles_of, servo, tones

from rhythmid.start.start import guess, start

TIME = np.arange(8000) * foreign.STEP
FORCE, OTHER = tones(1, TIME), tones(9, TIME)
REFERENCE = 0.5 * tones(3, TIME, low=0.2, high=0.8)
X, V, _ = servo(REFERENCE, gain=40000.0, damping=400.0)
RATE = np.gradient(REFERENCE, foreign.STEP)
LOOSE = X + 0.5 * OTHER  # goes along in part


def table(folder: Path, **columns: np.ndarray) -> Path:
    np.savez(folder / "run.npz", time=TIME, **columns)
    return folder / "run.npz"


@pytest.mark.parametrize("asked", ["tq", "target_q", "q_cmd"])
def test_a_reference_that_is_followed_nearly_perfectly_drives(tmp_path, asked):
    path = table(tmp_path, q=X, qd=V, **{asked: REFERENCE}, other=LOOSE, tcp=LOOSE**2)
    found = guess(path)
    assert {role: str(one.recorded) for role, one in found.roles.choices.items()} == {
        "output": "q", "velocity": "qd", "input": asked,
    }  # fmt: skip
    assert found.roles.input_kind == "reference"


def test_a_t_before_a_name_of_another_joint_says_nothing(tmp_path):
    path = table(
        tmp_path, q_0=X, q_1=0.1 * OTHER, tq_0=REFERENCE, tq_1=0.1 * np.roll(OTHER, 20), tqd_0=RATE, qd_0=V
    )
    found = guess(path, joint="0")
    assert str(found.roles.choices["input"].recorded) == "tq_0" and found.roles.joint.name == "0"
    assert any("'t' before q_0" in line for line in found.lines())


@pytest.mark.parametrize(
    "name", ["tcp_0", "counter_active", "data_id", "system state", "flag", "pose_0", "target_id"]
)
def test_the_place_of_a_tool_a_counter_and_a_flag_are_no_efforts(tmp_path, name):
    position, _ = moved(FORCE, 0.05, 0.3, 6.0)
    assert set(roles_of(table(tmp_path, motor_pos=position, **{name: FORCE}))) == {"output"}


@pytest.mark.parametrize("name", ["tcp_force", "joint_state_torque", "control"])
def test_a_word_that_says_an_effort_says_it_beside_any_other(tmp_path, name):
    position, _ = moved(FORCE, 0.05, 0.3, 6.0)
    assert roles_of(table(tmp_path, motor_pos=position, **{name: FORCE}))["input"] == name


STEP = 30.0 * np.ones(len(TIME))
SPUN = moved(STEP, 0.05, 0.3, 0.0)[1]


def test_a_duty_that_is_on_from_the_first_sample_drives_before_a_load_that_was_measured(tmp_path):
    path = table(
        tmp_path, **{"Duty cycle [%]": STEP, "speed [deg/s]": SPUN, "Load [mNm]": 0.1 * SPUN + OTHER}
    )
    found = start([path])
    assert str(found.guess.roles.choices["input"].recorded) == "Duty cycle [%]"
    assert "effort" not in found.guess.roles.choices and "Load [mNm]" in found.signals
    inertia, damping = found.nominal.model.mass.value, found.nominal.model.value("viscous_damper.damping")
    assert inertia > 1e-3 * damping  # what follows within a sample at least


@pytest.mark.parametrize(
    "constant", [{"supply_voltage": STEP}, {"duty": 0.0 * STEP}], ids=["a supply", "a duty that is off"]
)
def test_a_supply_and_a_duty_that_is_off_drive_nothing_beside_a_current(tmp_path, constant):
    path = table(tmp_path, speed=SPUN, current=FORCE + 1.0, **constant)
    assert roles_of(path)["input"] == "current"


def test_a_machine_that_runs_from_the_first_sample_on_shows_no_step(tmp_path):
    speed = moved(FORCE, 0.05, 0.3, 0.0)[1] + 100.0
    assert roles_of(table(tmp_path, speed=speed, current=FORCE, duty=STEP))["input"] == "current"
