"""Which joint is looked at where joints are called by words that could be quantities, and what of another one is left alone."""

import foreign
import numpy as np
import pytest
from foreign import roles_of, servo, tones

from rhythmid.errors import InputError
from rhythmid.start.start import guess

FINE = np.arange(16000) * foreign.STEP
TIME = FINE[::20]


def joint(name: str, seed: int, size: float) -> dict[str, np.ndarray]:
    """Command, position, velocity and torque of one joint of a servo, every 20 ms."""
    asked = size * tones(seed, FINE, 0.3, 0.2, 1.5)
    columns = dict(zip(("command", "position", "velocity", "torque"), (asked, *servo(asked)), strict=True))
    noise = np.random.default_rng(seed).standard_normal(len(TIME))
    return {f"{what}_{name}": value[::20] + 1e-4 * noise for what, value in columns.items()}


def still(name: str) -> dict[str, np.ndarray]:
    """A joint that holds its place, of which only the torque is not constant."""
    noise = np.random.default_rng(len(name)).standard_normal(len(TIME))
    columns = {f"{what}_{name}": np.full(len(TIME), 0.2) for what in ("command", "position", "velocity")}
    return {**columns, f"torque_{name}": noise}


@pytest.fixture
def arm(tmp_path):
    def write(*joints: dict[str, np.ndarray]):
        np.savez(
            tmp_path / "run.npz", t=TIME, **{name: value for one in joints for name, value in one.items()}
        )
        return tmp_path / "run.npz"

    return write


def own(name: str) -> dict[str, str]:
    return {
        "output": f"position_{name}",
        "velocity": f"velocity_{name}",
        "effort": f"torque_{name}",
        "reference": f"command_{name}",
    }


@pytest.mark.parametrize("name", ["Rotation", "Extension", "Shoulder_Rotation", "Lift"])
def test_a_joint_that_is_called_by_a_word_of_motion_is_a_joint(arm, name):
    source = arm(joint("Pitch", 2, 0.05), joint(name, 3, 1.0), still("Elbow"), still("Wrist_Pitch"))
    assert roles_of(source) == own(name)
    assert guess(source).roles.joint.name == name.lower()
    assert guess(source).roles.joint.others == ["pitch", "elbow", "wrist_pitch"]


def test_one_such_joint_alone_is_read_by_its_other_words(arm):
    assert roles_of(arm(joint("Rotation", 3, 1.0))) == own("Rotation")


def test_of_two_columns_of_a_kind_a_name_stands_in_the_place_of_the_other(arm):
    columns = {**joint("Rotation", 3, 1.0), **joint("Pitch", 2, 0.05)}
    kept = {name: value for name, value in columns.items() if name.split("_")[0] in ("command", "position")}
    assert roles_of(arm(kept)) == {"output": "position_Rotation", "input": "command_Rotation"}


def test_the_joint_of_such_a_name_may_be_asked_for_and_one_that_stands_still_is_refused(arm):
    source = arm(joint("Rotation", 3, 1.0), joint("Pitch", 2, 0.05), still("Elbow"))
    assert roles_of(source, joint="pitch") == own("Pitch")
    with pytest.raises(InputError, match="joint 'elbow' stands still"):
        guess(source, joint="elbow")


def test_an_angle_whose_slopes_were_recorded_beside_it_is_no_name(arm):
    columns = joint("a", 3, 1.0)
    source = arm(
        {"theta": columns["position_a"], "theta_dot_vel": columns["velocity_a"], "tau": columns["torque_a"]}
    )
    assert roles_of(source) == {"output": "theta", "velocity": "theta_dot_vel", "input": "tau"}


def test_a_command_that_no_name_calls_an_effort_and_that_hardly_goes_with_the_output_does_not_drive(arm):
    other = {"led_command": np.random.default_rng(0).standard_normal(len(TIME))}
    columns = {name: value for name, value in joint("x", 3, 1.0).items() if not name.startswith("torque")}
    assert roles_of(arm({**columns, **other}))["input"] == "command_x"


def named(name: str, seed: int, size: float) -> dict[str, np.ndarray]:
    """Position, velocity and torque of one joint, called by symbols."""
    position, velocity, torque = servo(size * tones(seed, FINE, 0.3, 0.2, 1.5))
    noise = 1e-4 * np.random.default_rng(seed).standard_normal(len(TIME))
    columns = {"q": position, "qd": velocity, "tau": torque}
    return {f"{what}_{name}": value[::20] + noise for what, value in columns.items()}


@pytest.mark.parametrize("name", ["SP", "BASE", "SET", "CON"])
def test_a_suffix_that_all_quantities_share_as_other_joints_do_is_a_joint_whatever_it_means_else(arm, name):
    source = arm(named("ELBOW", 2, 1.0), named(name, 3, 0.5), named("WR", 4, 0.3), named("WP", 5, 0.2))
    expected = {"output": "q_ELBOW", "velocity": "qd_ELBOW", "input": "tau_ELBOW"}
    assert roles_of(source, joint="ELBOW") == expected
    assert not any(
        "base" in line for line in guess(source, joint="ELBOW").lines() if line.startswith("CHECK")
    )
    assert roles_of(source, joint=name)["input"] == f"tau_{name}"


def test_a_word_of_a_command_beside_the_measured_quantity_of_the_same_name_is_none(arm):
    columns = named("a", 3, 1.0)
    asked = tones(3, FINE, 0.3, 0.2, 1.5)[::20]
    source = arm({"q": columns["q_a"], "q_SP": asked, "tau": columns["tau_a"]})
    assert roles_of(source) == {"output": "q", "effort": "tau", "reference": "q_SP"}


@pytest.mark.parametrize("wanted", ["pitch", "Pitch", "arm pitch", "telemetry_pitch"])
def test_a_joint_may_be_called_by_any_of_its_words_that_no_other_one_has(arm, wanted):
    source = arm(joint("arm_telemetry_pitch", 2, 1.0), joint("leg_telemetry_roll", 3, 0.5))
    if wanted == "arm pitch":
        with pytest.raises(InputError, match="no joint is called 'arm pitch'"):
            guess(source, joint=wanted)
        return
    assert guess(source, joint=wanted).roles.joint.name == "arm_telemetry_pitch"


def test_words_that_several_joints_share_are_refused_with_their_names(arm):
    source = arm(joint("arm_pitch", 2, 1.0), joint("arm_roll", 3, 0.5))
    with pytest.raises(InputError, match="no joint is called 'arm'; it has arm_pitch, arm_roll"):
        guess(source, joint="arm")
