"""Roles of what foreign robots record: found by types, names, units and by what the data say."""

import foreign
import numpy as np
import pytest
from foreign import joint_state, message, moved, roles_of, servo, tones

from rhythmid.errors import InputError
from rhythmid.model import Model
from rhythmid.record.read import read_record
from rhythmid.record.signals import Signals
from rhythmid.start.start import guess, start

TIME = np.arange(8000) * foreign.STEP
FORCE = tones(1, TIME)
X, V = moved(FORCE, 0.05, 0.1, 6.0)
REFERENCE = tones(2, TIME, 0.3, 0.2, 1.5)
ROWS = range(0, 8000, 4)
NOW = 1.7e9


def two_joints(command, command_type="effort") -> dict:
    """Joint states of a hip that hardly moves and a knee, and commands of a type of the robot's own."""
    states = [
        (NOW + TIME[k] + 2e-4, joint_state(NOW + TIME[k], ["hip", "knee"], position=[0.01 * np.sin(TIME[k]), X[k]], velocity=[0.01 * np.cos(TIME[k]), V[k]]))
        for k in ROWS
    ]  # fmt: skip
    return {
        "/robot/joint_states": states,
        "/robot/commands": [(NOW + TIME[k] + 1e-4, command(k)) for k in ROWS],
    }


OTHER = 0.1 * tones(9, TIME)


@pytest.mark.parametrize(
    ("command", "field"),
    [
        (lambda k: joint_state(NOW + TIME[k], ["hip", "knee"], effort=[OTHER[k], FORCE[k]]), "effort[knee]"),
        (lambda k: foreign.array([OTHER[k], FORCE[k]]), "data[1]"),
        (lambda k: message("std_msgs/msg/Float64", data=float(FORCE[k])), "data"),
        (lambda k: foreign.wrench(NOW + TIME[k], float(FORCE[k]), 0.0), "wrench.force.x"),
    ],
    ids=["JointState", "Float64MultiArray", "Float64", "WrenchStamped"],
)
def test_an_effort_command_of_any_type_is_the_input_of_the_joint_that_moves_most(tmp_path, command, field):
    bag = foreign.write(tmp_path / "bag", two_joints(command))
    assert roles_of(bag) == {
        "output": "/robot/joint_states position[knee]", "velocity": "/robot/joint_states velocity[knee]",
        "input": f"/robot/commands {field}",
    }  # fmt: skip
    text = guess(bag).signals
    assert ("time: receive" in text) == field.startswith("data")
    assert "joint: knee" in text and "hip (" in text


@pytest.mark.parametrize(("name", "unit"), [("cyl", "N"), ("knee", "N*m")])
def test_a_measured_force_says_that_a_joint_slides_before_the_topic_does_and_after_the_joint_s_name(
    tmp_path, name, unit
):
    """Every robot's topic is called joint_states."""
    topics = {
        "/axis/joint_states": [
            (NOW + TIME[k] + 2e-4, joint_state(NOW + TIME[k], [name], position=[X[k]])) for k in ROWS
        ],
        "/axis/load_cell": [
            (NOW + TIME[k] + 1e-4, foreign.wrench(NOW + TIME[k], float(FORCE[k]), 0.0)) for k in ROWS
        ],
    }
    found = guess(foreign.write(tmp_path / "bag", topics))
    assert found.roles.rotary == (unit == "N*m")
    assert f'unit: "{unit}"' in found.signals


def test_a_joint_may_be_asked_for_and_one_that_is_not_there_is_refused(tmp_path):
    command = two_joints(lambda k: joint_state(NOW + TIME[k], ["hip", "knee"], effort=[OTHER[k], FORCE[k]]))
    bag = foreign.write(tmp_path / "bag", command)
    assert roles_of(bag, joint="hip")["input"] == "/robot/commands effort[hip]"
    with pytest.raises(InputError, match="no joint is called 'ankle'; it has hip, knee"):
        guess(bag, joint="ankle")


def test_a_wrench_beside_a_command_is_the_forcing(tmp_path):
    pump = np.cos(2.0 * np.pi * TIME)
    topics = two_joints(lambda k: joint_state(NOW + TIME[k], ["knee"], effort=[FORCE[k]]))
    topics["/pump"] = [(NOW + TIME[k], foreign.wrench(NOW + TIME[k], 0.0, float(pump[k]))) for k in ROWS]
    found = roles_of(foreign.write(tmp_path / "bag", topics))
    assert found["forcing"] == "/pump wrench.force.z" and found["input"] == "/robot/commands effort[knee]"


@pytest.mark.parametrize("named", ["position_command", "goal", "cmd"])
def test_a_servo_of_which_only_the_command_is_known_gets_a_controller(tmp_path, named):
    x, v, _ = servo(REFERENCE)
    topics = {
        "/states": [
            (NOW + TIME[k], joint_state(NOW + TIME[k], ["a"], position=[x[k]], velocity=[v[k]])) for k in ROWS
        ],
        f"/{named}": [
            (NOW + TIME[k], message("std_msgs/msg/Float64", data=float(REFERENCE[k]))) for k in ROWS
        ],
    }
    bag = foreign.write(tmp_path / "bag", topics)
    begun = start([bag])
    assert begun.guess.roles.input_kind == "reference"
    assert begun.nominal.model.value("position_control.proportional") == pytest.approx(400.0, rel=0.2)
    assert begun.nominal.model.units.force == "rad/s^2"


def test_a_servo_whose_inertia_follows_within_a_sample_gets_gains_that_can_be_simulated(tmp_path):
    lag, every = 0.25, 20  # s, milliseconds between samples
    x = np.zeros(len(REFERENCE))
    for k, wanted in enumerate(REFERENCE[:-1]):
        x[k + 1] = x[k] + foreign.STEP * (wanted - x[k]) / lag
    table = np.column_stack([TIME, REFERENCE, x])[::every]
    path = tmp_path / "servo.csv"
    np.savetxt(path, table, delimiter=",", header="time [s],reference [rad],position [rad]", comments="")
    model = start([path]).nominal.model
    proportional = model.value("position_control.proportional")
    derivative = model.value("position_control.derivative")
    assert derivative / proportional == pytest.approx(lag, rel=0.1)
    assert derivative <= 1.01 / (every * foreign.STEP)


def test_reference_and_effort_give_the_controllers_gains(tmp_path):
    x, v, torque = servo(REFERENCE)
    topics = {
        "/states": [(NOW + TIME[k], joint_state(NOW + TIME[k], ["a"], position=[x[k]], velocity=[v[k]], effort=[torque[k]])) for k in ROWS],
        "/targets": [(NOW + TIME[k], joint_state(NOW + TIME[k], ["a"], position=[REFERENCE[k]])) for k in ROWS],
    }  # fmt: skip
    begun = start([foreign.write(tmp_path / "bag", topics)])
    assert set(begun.guess.roles.choices) == {"output", "velocity", "effort", "reference"}
    model = begun.nominal.model
    assert model.value("position_control.proportional") == pytest.approx(400.0, rel=0.1)
    assert model.value("position_control.derivative") == pytest.approx(28.0, rel=0.2)
    assert model.value("inertia.mass") == pytest.approx(1.0, rel=0.1)
    # in closed loop the motion alone does not tell their scale: it stays that of the effort
    for name, true in (("proportional", 400.0), ("derivative", 28.0)):
        prior = Model.from_text(begun.model).parameters[f"position_control.{name}"].prior
        assert prior is not None and abs(prior.mean - true) < 3.0 * prior.std < 0.5 * true


def test_an_accelerometer_and_a_thrust_of_which_only_the_topic_tells(tmp_path):
    pulled = np.gradient(V, foreign.STEP)
    topics = {
        "/drone/imu": [(NOW + TIME[k], foreign.imu(NOW + TIME[k], float(pulled[k]))) for k in ROWS],
        "/drone/thrust_cmd": [
            (NOW + TIME[k], message("std_msgs/msg/Float32", data=float(FORCE[k]))) for k in ROWS
        ],
        "/drone/note": [(NOW, message("std_msgs/msg/String", data="take-off"))],
    }
    begun = start([foreign.write(tmp_path / "bag", topics)])
    assert begun.guess.roles.output_kind == "acceleration" and set(begun.guess.roles.choices) == {
        "input",
        "output",
    }
    assert begun.nominal.model.value("inertia.mass") == pytest.approx(0.05, rel=0.1)


def test_a_pose_and_a_force_plate_whose_axis_the_data_tell(tmp_path):
    topics = {
        "/mocap/pose": [(NOW + TIME[k], foreign.pose(NOW + TIME[k], float(X[k]))) for k in ROWS],
        "/plate": [
            (NOW + TIME[k], foreign.wrench(NOW + TIME[k], float(OTHER[k]), float(FORCE[k]))) for k in ROWS
        ],
    }
    found = roles_of(foreign.write(tmp_path / "bag", topics))
    assert found == {"output": "/mocap/pose pose.position.z", "input": "/plate wrench.force.z"}


def test_a_free_decay_gets_a_model_per_unit_of_inertia(tmp_path):
    time = np.arange(1200) * 0.005
    np.savez(tmp_path / "run.npz", t=time, x=0.1 * np.exp(-time) * np.cos(20 * time))
    model = start([tmp_path / "run.npz"]).nominal.model
    assert model.free and "inertia.mass" not in model.free
    assert model.value("linear_spring.stiffness") == pytest.approx(401.0, rel=0.02)
    assert model.value("viscous_damper.damping") == pytest.approx(2.0, rel=0.1)


TABLES = {
    "classical": ({"t": TIME, "u": FORCE, "y": X}, {"input": "u", "output": "y"}),
    "units": ({"time [ms]": 1e3 * TIME, "angle [deg]": np.degrees(X), "tau [Nm]": FORCE}, {"input": "tau [Nm]", "output": "angle [deg]"}),
    "suffixes": ({"stamp_ns": 1e9 * (NOW + TIME), "pos_deg": np.degrees(X), "vel_deg_s": np.degrees(V), "torque_nm": FORCE},
                 {"input": "torque_nm", "output": "pos_deg", "velocity": "vel_deg_s"}),
    "measured effort": ({"timestamp": TIME, "position": X, "velocity": V, "current": FORCE}, {"input": "current", "output": "position", "velocity": "velocity"}),
    "commanded and measured": ({"time": TIME, "q": X, "dq": V, "tau_cmd": FORCE, "tau_meas": FORCE + 0.05 * V, "temp": 30 + TIME},
                               {"input": "tau_cmd", "effort": "tau_meas", "output": "q", "velocity": "dq"}),
    "joints": ({"t": TIME, "q1": 0.1 * X, "q2": X, "tau1": OTHER, "tau2": FORCE}, {"input": "tau2", "output": "q2"}),
    "nothing but letters": ({"t": TIME, "a1": FORCE, "a2": X}, {"input": "a1", "output": "a2"}),
    "numbers": ({"0": TIME, "1": X, "2": FORCE}, {"input": "2", "output": "1"}),
    "a counter": ({"index": np.arange(8000), "seconds": TIME, "displacement": X, "force": FORCE}, {"input": "force", "output": "displacement"}),
    "speed only": ({"t": TIME, "current [A]": FORCE, "speed [rpm]": 30 / np.pi * V}, {"input": "current [A]", "output": "speed [rpm]"}),
    "in German": ({"Zeit [s]": TIME, "Winkel [°]": np.degrees(X), "Moment [Nm]": FORCE}, {"input": "Moment [Nm]", "output": "Winkel [°]"}),
    "a decay": ({"t": TIME, "x": np.exp(-TIME / 3) * np.cos(9 * TIME)}, {"output": "x"}),
    "a shaken base": ({"t": TIME, "base_acc [m/s^2]": FORCE, "x [mm]": 1e3 * X}, {"input": "base_acc [m/s^2]", "output": "x [mm]"}),
}  # fmt: skip


@pytest.mark.parametrize("layout", TABLES)
def test_the_roles_of_a_tables_columns_are_found(tmp_path, layout):
    columns, expected = TABLES[layout]
    rows = slice(0, None, 8)
    np.savez(tmp_path / "run.npz", **{name: np.asarray(value)[rows] for name, value in columns.items()})
    assert roles_of(tmp_path / "run.npz") == expected
    Signals.from_text(start([tmp_path / "run.npz"]).guess.signals)


def test_what_is_read_with_the_guess_is_in_si_units(tmp_path):
    columns, _ = TABLES["suffixes"]
    np.savez(tmp_path / "run.npz", **columns)
    record = read_record(tmp_path / "run.npz", Signals.from_text(guess(tmp_path / "run.npz").signals))
    np.testing.assert_allclose(record.output.value, X, atol=1e-9)
    np.testing.assert_allclose(record.output.time, TIME, atol=1e-6)
    assert record.output.unit == "rad" and record.input.unit == "N*m"


def test_degrees_beside_a_speed_in_radians_are_told(tmp_path):
    np.savez(tmp_path / "run.npz", t=TIME, angle=np.degrees(X), omega=V, tau=FORCE)
    text = " ".join(guess(tmp_path / "run.npz").signals.replace("#", " ").split())
    assert "CHECK" in text and "may be in degrees: scale: 0.0174532925" in text


def test_the_values_of_the_nominal_model_are_near_the_truth(tmp_path):
    np.savez(tmp_path / "run.npz", t=TIME, angle=X, tau=FORCE)
    model = start([tmp_path / "run.npz"]).nominal.model
    assert model.value("inertia.mass") == pytest.approx(0.05, rel=0.05)
    assert model.value("linear_spring.stiffness") == pytest.approx(6.0, rel=0.05)
    assert model.value("viscous_damper.damping") == pytest.approx(0.1, rel=0.1)


def test_a_pendulum_that_swings_wide_gets_its_gravity_and_not_a_spring(tmp_path):
    x = v = 0.0
    angle = np.zeros(len(TIME))
    for k, torque in enumerate(2.0 * FORCE):
        angle[k] = x
        v += foreign.STEP * (torque - 0.1 * v - 3.5 * np.sin(x)) / 0.18
        x += foreign.STEP * v
    np.savez(tmp_path / "run.npz", t=TIME, angle=angle, torque=2.0 * FORCE)
    model = start([tmp_path / "run.npz"]).nominal.model
    assert model.value("pendulum_gravity.moment") == pytest.approx(3.5, rel=0.05)
    assert model.term("linear_spring") is None


def test_close_candidates_are_asked_for_and_the_answer_counts(tmp_path):
    np.savez(tmp_path / "run.npz", t=TIME, pos_a=X, pos_b=0.9 * X[::-1], force=FORCE)
    asked: list[tuple[str, list[str]]] = []

    def answer(question, answers):
        asked.append((question, list(answers)))
        return len(answers) - 1

    found = guess(tmp_path / "run.npz", ask=answer)
    assert asked[0][1] == ["a", "b"] or asked[0][1] == ["pos_a", "pos_b"]
    assert str(found.roles.choices["output"].recorded) == "pos_b"
    assert str(guess(tmp_path / "run.npz").roles.choices["output"].recorded) == "pos_a"


@pytest.mark.parametrize(
    ("columns", "words"),
    [
        (
            {"a": X, "b": FORCE},
            "no column goes forward like a time (a, b); give the rows' rate with --rate HZ",
        ),
        ({"t": TIME, "y": 0 * X}, "holds nothing that could be a motion"),
        ({"t": TIME, "note": np.array(["x"] * len(TIME))}, "holds nothing that could be a motion"),
        ({"note": np.array(["x"] * len(TIME))}, "holds no column of numbers"),
    ],
)
def test_a_source_that_tells_no_motion_is_refused_in_one_line(tmp_path, columns, words):
    np.savez(tmp_path / "run.npz", **columns)
    with pytest.raises(InputError) as refused:
        guess(tmp_path / "run.npz")
    assert words in str(refused.value) and "\n" not in str(refused.value)


def test_rows_without_a_time_are_read_at_the_rate_that_is_given(tmp_path):
    np.savez(tmp_path / "run.npz", V1=FORCE, V2=X)
    assert roles_of(tmp_path / "run.npz", rate=1000.0) == {"input": "V1", "output": "V2"}
    assert "sample_rate: 1000.0" in guess(tmp_path / "run.npz", rate=1000.0).signals


def gapped(time: np.ndarray) -> np.ndarray:
    """Times with a gap behind the first row, and a few more later on."""
    later = np.zeros(len(time))
    later[[1, *range(900, len(time), 900)]] = 0.41
    return time + np.cumsum(later)


@pytest.mark.parametrize(
    ("name", "scale", "written"),
    [("pi_time", 1.0, '{column: "pi_time"}'), ("0", 1e3, '{column: "0", scale: 0.001}'), ("T/ms", 1e3, "")],
)
def test_a_time_may_have_gaps(tmp_path, name, scale, written):
    np.savez(tmp_path / "run.npz", **{name: scale * gapped(TIME[::8]), "force": FORCE[::8], "angle": X[::8]})
    found = guess(tmp_path / "run.npz")
    assert f"time: {written}" in found.signals
    assert {role: str(choice.recorded) for role, choice in found.roles.choices.items()} == {
        "input": "force", "output": "angle"
    }  # fmt: skip
    record = read_record(tmp_path / "run.npz", Signals.from_text(found.signals))
    assert np.ptp(record.output.time) == pytest.approx(np.ptp(gapped(TIME[::8])), rel=1e-6)


def test_a_column_called_time_is_the_time_before_a_kind_of_time(tmp_path):
    np.savez(tmp_path / "run.npz", cpu_time=0.3 * TIME, t=TIME, force=FORCE, angle=X)
    text = guess(tmp_path / "run.npz").signals
    assert 'time: {column: "t"}' in text and "cpu_time" not in text


def test_what_only_drifts_upward_is_no_time(tmp_path):
    np.savez(tmp_path / "run.npz", a=np.cumsum(np.abs(FORCE)), b=X)
    with pytest.raises(InputError, match="no column goes forward like a time"):
        guess(tmp_path / "run.npz")


def test_a_velocity_is_recognised_beside_a_gap(tmp_path):
    angle = X[::8].copy()
    angle[0] = 5.0  # what was in the register before the machine was switched on
    time = TIME[::8].copy()
    time[1:] += 0.41
    np.savez(tmp_path / "run.npz", t=time, angle=angle, omega=V[::8], torque=FORCE[::8])
    assert roles_of(tmp_path / "run.npz")["velocity"] == "omega"


def test_a_time_is_no_channel_beside_a_rate_that_is_given(tmp_path):
    table = {"0": 1e3 * gapped(TIME[::8]), "1": FORCE[::8], "2": X[::8]}
    np.savez(tmp_path / "run.npz", **table)
    text = guess(tmp_path / "run.npz", rate=125.0).signals
    assert "Left out: 0: goes forward like a time" in text


def test_an_effort_that_never_changes_is_a_step_where_nothing_else_drives(tmp_path):
    after = TIME[::8]
    speed = 0.6 * (1.0 - np.exp(-after / 0.3))
    np.savez(tmp_path / "run.npz", t=after, voltage=np.full(len(after), 10.0), speed=speed)
    found = guess(tmp_path / "run.npz")
    assert found.roles.choices["input"].recorded.column == "voltage"
    assert "CHECK: it never changes: taken for a step" in found.signals and "Left out" not in found.signals
    np.savez(tmp_path / "off.npz", t=after, voltage=np.zeros(len(after)), speed=speed)
    assert roles_of(tmp_path / "off.npz") == {"output": "speed"}


def test_a_unit_that_is_glued_to_a_name_tells_that_the_machine_turns(tmp_path):
    np.savez(tmp_path / "run.npz", t=TIME, u=FORCE, yrad=X)
    found = guess(tmp_path / "run.npz")
    assert found.roles.rotary and 'output: {column: "yrad", unit: "rad"}' in found.signals


def test_an_inertia_that_the_record_does_not_tell_is_what_follows_within_a_sample(tmp_path):
    every, damping = 20, 0.6
    speed = FORCE / damping
    place = foreign.STEP * np.cumsum(speed)
    rng = np.random.default_rng(0)
    noisy = FORCE + 0.05 * rng.standard_normal(len(FORCE))
    np.savez(tmp_path / "run.npz", t=TIME[::every], position=place[::every], force=noisy[::every])
    begun = start([tmp_path / "run.npz"])
    model = begun.nominal.model
    step = every * foreign.STEP
    assert model.value("viscous_damper.damping") == pytest.approx(damping, rel=0.1)
    assert model.value("inertia.mass") / model.value("viscous_damper.damping") == pytest.approx(
        step, rel=0.05
    )
    assert "CHECK inertia.mass: the records do not determine the inertia" in "\n".join(begun.lines())
    assert "#   CHECK: the records do not determine the inertia" in begun.model


def test_the_interval_within_which_an_inertia_is_not_told_is_that_of_the_filtered_motion(tmp_path):
    rng = np.random.default_rng(0)
    place = foreign.STEP * np.cumsum(FORCE / 0.6) + 1e-4 * rng.standard_normal(len(FORCE))
    noisy = FORCE + 0.05 * rng.standard_normal(len(FORCE))
    np.savez(tmp_path / "run.npz", t=TIME, position=place, force=noisy)
    begun = start([tmp_path / "run.npz"])
    model = begun.nominal.model
    interval = model.value("inertia.mass") / model.value("viscous_damper.damping")
    assert interval > 1.5 * foreign.STEP
    told = "\n".join(begun.lines())
    assert f"within {1e3 * interval:.2g}" in told and "once noise is filtered out" in told
