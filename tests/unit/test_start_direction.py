"""What is asked for leads what is measured, sides and joints are told apart, and what hardly goes with a motion does not drive it."""

import foreign
import numpy as np
import pytest
from foreign import moved, roles_of, servo, tones

from rhythmid.start.start import guess

TIME = np.arange(0, 8000, 4) * foreign.STEP
FINE = np.arange(8000) * foreign.STEP
REFERENCE = tones(2, FINE, 0.3, 0.2, 1.5)
ANSWER, _, EFFORT = (one[::4] for one in servo(REFERENCE))
REFERENCE = REFERENCE[::4]
NOISE = 1e-3 * np.random.default_rng(0).standard_normal(len(TIME))
FORCE = tones(1, FINE)
X, V = (one[::4] for one in moved(FORCE, 0.05, 0.1, 6.0))
OTHER_X, OTHER_V = (one[::4] for one in moved(tones(5, FINE, low=0.37, high=3.1), 0.06, 0.08, 4.0))
FORCE = FORCE[::4]


def write(folder, **columns):
    np.savez(folder / "run.npz", t=TIME, **columns)
    return folder / "run.npz"


@pytest.mark.parametrize(
    ("reference", "measured"), [("pos_in", "pos_out"), ("theta_b", "theta_a"), ("theta", "theta_b")]
)
def test_of_two_copies_of_a_motion_the_earlier_one_is_the_reference(tmp_path, reference, measured):
    source = write(tmp_path, **{reference: REFERENCE, measured: ANSWER + NOISE})
    assert roles_of(source) == {"input": reference, "output": measured}
    (line,) = [line for line in guess(source).lines() if line.startswith("CHECK")]
    assert f"{reference} is taken for the reference, because it leads by" in line
    with_effort = write(tmp_path, **{reference: REFERENCE, measured: ANSWER + NOISE, "tau": EFFORT})
    assert roles_of(with_effort) == {"reference": reference, "output": measured, "effort": "tau"}


def test_a_reference_that_comes_after_the_measurement_is_doubted(tmp_path):
    source = write(tmp_path, q_set=ANSWER + NOISE, q_real=REFERENCE)
    assert roles_of(source) == {"input": "q_set", "output": "q_real"}
    assert any("are the two exchanged" in line for line in guess(source).lines())
    in_order = write(tmp_path, q_set=REFERENCE, q_real=ANSWER + NOISE)
    assert not any("exchanged" in line for line in guess(in_order).lines())


def test_a_filtered_position_is_no_answer_to_the_raw_one(tmp_path):
    found = roles_of(write(tmp_path, pos_raw=REFERENCE, pos_filtered=ANSWER, tau=EFFORT))
    assert "reference" not in found and found["input"] == "tau"


def test_joints_that_follow_one_another_are_told_and_not_taken(tmp_path):
    source = write(tmp_path, pos1=REFERENCE, pos2=ANSWER + NOISE)
    assert set(roles_of(source)) == {"output"}
    assert any("pos1 leads pos2 by" in line for line in guess(source).lines())


@pytest.mark.parametrize("name", ["hip", "m2"])
def test_what_hardly_goes_with_the_output_drives_only_where_its_name_says_so(tmp_path, name):
    source = write(tmp_path, knee_pos=X, **{name: OTHER_X})
    assert set(roles_of(source)) == {"output"}
    (line,) = [line for line in guess(source).lines() if line.startswith("CHECK")]
    assert f"{name} (coherence 0.0" in line and "nothing is taken to drive the machine" in line
    assert "# CHECK: nothing is taken to drive the machine" in guess(source).signals
    asked: list[str] = []
    chosen = guess(source, ask=lambda question, answers: asked.extend(answers) or 1 if name in answers else 0)
    assert str(chosen.roles.choices["input"].recorded) == name and asked == ["nothing of these", name]
    assert roles_of(write(tmp_path, knee_pos=X, input=OTHER_X))["input"] == "input"


@pytest.mark.parametrize(
    ("columns", "roles"),
    [
        ({"w_l": V, "w_r": OTHER_V}, {"output": "w_r"}),
        ({"v_left": V, "v_right": OTHER_V}, {"output": "v_right"}),
        ({"wl": V, "wr": OTHER_V, "pwml": FORCE, "pwmr": 2 * FORCE}, {"output": "wr", "input": "pwmr"}),
        (
            {"vl": V, "vr": OTHER_V, "left_pwm": FORCE, "right_pwm": FORCE},
            {"output": "vr", "input": "right_pwm"},
        ),
        (
            {"wheelLeft": V, "wheelRight": V + NOISE, "refLeft": np.roll(V, -5), "refRight": np.roll(V, -5)},
            {"output": "wheelLeft", "input": "refLeft"},
        ),
    ],
)
def test_the_other_side_neither_drives_nor_is_asked_for(tmp_path, columns, roles):
    found = roles_of(write(tmp_path, **columns))
    if roles["output"].startswith("wheel"):
        assert found["output"][5:] == found["input"][3:] and found["output"].startswith("wheel")
    else:
        assert found == roles


def test_an_r_without_a_left_one_is_a_reference(tmp_path):
    assert roles_of(write(tmp_path, y=ANSWER, r=REFERENCE)) == {"input": "r", "output": "y"}


@pytest.mark.parametrize(
    ("base", "output", "doubted"),
    [
        ("road_profile [m]", "z [m]", False),
        ("base displacement [mm]", "mass displacement [mm]", False),
        ("ground_disp", "disp", False),
        ("excitation [mm]", "x [mm]", True),
        ("exc_disp", "mass_disp", True),
        ("shaker", "x", True),
        ("z_r", "z_s", True),
    ],
)
def test_a_motion_of_the_base_is_no_force(tmp_path, base, output, doubted):
    found = guess(write(tmp_path, **{base: 0.01 * FORCE, output: X}))
    assert found.roles.input_kind == "base_displacement" and "kind: base_displacement" in found.signals
    assert {role: str(one.recorded) for role, one in found.roles.choices.items()} == {
        "input": base,
        "output": output,
    }
    assert (
        any("CHECK input: taken for a displacement of the base" in line for line in found.lines()) == doubted
    )


def test_a_motor_that_leads_its_load_is_no_reference_and_the_loads_angle_no_effort(tmp_path):
    found = roles_of(write(tmp_path, theta_motor=REFERENCE, theta_load=ANSWER + NOISE, tau=EFFORT))
    assert "reference" not in found and found["input"] == "tau" and found["output"].startswith("theta")


def test_two_sensors_that_are_a_sample_apart_are_none_the_others_reference(tmp_path):
    found = roles_of(write(tmp_path, theta=X, theta_b=np.roll(X, 1) + NOISE, tau=FORCE))
    assert "reference" not in found and found["input"] == "tau"


def test_a_base_that_moves_beside_a_force_is_told(tmp_path):
    found = guess(write(tmp_path, **{"road [mm]": 10.0 * OTHER_X, "x [m]": X, "F [N]": FORCE}))
    assert str(found.roles.choices["input"].recorded) == "F [N]"
    assert any(
        line.startswith("CHECK input: a motion of the base was recorded, too (road [mm])")
        for line in found.lines()
    )


def slow(asked: np.ndarray, lag: float = 0.2) -> np.ndarray:
    """What a servo makes of what it is asked for that comes a time constant [s] later and does not reach it."""
    answer = np.zeros(len(asked))
    for k, wanted in enumerate(asked[:-1]):
        answer[k + 1] = answer[k] + foreign.STEP * (wanted - answer[k]) / lag
    return answer


ASKED = 600.0 * tones(4, np.arange(20000) * foreign.STEP, 1.0, 0.2, 0.9)
SLOW = slow(ASKED)


def test_an_encoder_is_a_measurement_and_what_its_motion_follows_is_the_reference(tmp_path):
    topics = {
        "/servo/position_data": [(1.7e9 + foreign.STEP * k, foreign.array([ASKED[k]])) for k in range(0, 20000, 10)],
        "/servo/encoder_data": [(1.7e9 + foreign.STEP * k, foreign.array([SLOW[k]])) for k in range(7, 20000, 150)],
    }  # fmt: skip
    bag = foreign.write(tmp_path / "bag", topics)
    assert roles_of(bag) == {"input": "/servo/position_data data[0]", "output": "/servo/encoder_data data[0]"}
    found = guess(bag)
    assert found.roles.input_kind == "reference"
    (line,) = [line for line in found.lines() if line.startswith("CHECK")]
    assert "no name says that /servo/position_data data[0] was asked for" in line


@pytest.mark.parametrize("measured", ["encoder", "pos_feedback", "pos_actual", "pos_state"])
def test_a_motion_without_a_word_leads_one_that_is_called_measured(tmp_path, measured):
    columns = {"pos": ASKED[::20], measured: SLOW[::20] + NOISE[:1000]}
    np.savez(tmp_path / "run.npz", t=0.02 * np.arange(1000), **columns)
    assert roles_of(tmp_path / "run.npz") == {"input": "pos", "output": measured}


def test_a_second_sensor_that_does_not_lead_the_encoder_is_no_reference(tmp_path):
    for second in (X + NOISE, np.roll(X, 1) + NOISE):
        assert roles_of(write(tmp_path, encoder=X, pos=second)) == {"output": "encoder"}
