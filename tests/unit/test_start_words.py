"""Words and numbers in names as robots' logs have them, and references that the output does not follow."""

from pathlib import Path

import foreign
import numpy as np
import pytest
from foreign import joint_state, moved, roles_of, servo, tones

from rhythmid.errors import InputError
from rhythmid.record.inventory import Recorded
from rhythmid.start.meaning import force_unit_of
from rhythmid.start.start import guess, start
from rhythmid.start.words import words_of

TIME = np.arange(8000) * foreign.STEP
FORCE, OTHER = tones(1, TIME), tones(9, TIME)
X, V = moved(FORCE, 0.05, 0.3, 6.0)
NOW = 1.7e9


def table(folder: Path, **columns: np.ndarray) -> Path:
    np.savez(folder / "run.npz", t=TIME, **columns)
    return folder / "run.npz"


def test_tor_is_a_torque_and_des_says_that_it_was_asked_for(tmp_path):
    path = table(tmp_path, torDes=FORCE, posAct=X, velAct=V, torAct=FORCE + 0.1 * OTHER)
    found = roles_of(path)
    assert found == {"output": "posAct", "velocity": "velAct", "input": "torDes", "effort": "torAct"}
    assert guess(path).roles.rotary


def test_a_number_tells_the_joint_whatever_words_stand_beside_it(tmp_path):
    still = 0.01 * tones(5, TIME)
    path = table(tmp_path, tau_cal_2=FORCE + 2.0 * OTHER, tau_cal_3=FORCE, joint_pos_2=X, joint_pos_3=still)
    assert roles_of(path) == {"output": "joint_pos_2", "input": "tau_cal_2"}


@pytest.mark.parametrize("lag", [-0.3, 0.06])
def test_what_the_output_goes_against_is_no_reference(tmp_path, lag):
    shifted = -np.interp(TIME + lag, TIME, X) + 0.2 * X.std() * OTHER
    found = roles_of(table(tmp_path, target_pos=shifted, pos=X, torque=FORCE))
    assert found == {"output": "pos", "input": "torque"}


def test_what_the_output_follows_is_a_reference(tmp_path):
    asked = tones(2, TIME, 0.3, 0.2, 1.5)
    x, _, torque = servo(asked)
    found = roles_of(table(tmp_path, target_pos=asked, pos=x, torque=torque))
    assert found == {"output": "pos", "effort": "torque", "reference": "target_pos"}


def test_an_output_of_two_values_is_not_taken_where_another_shows_a_motion(tmp_path):
    levels = np.where(np.sin(TIME) > 0.0, 3.0, -3.0)
    rows = range(0, 8000, 4)
    topics = {
        "/servo/in/state": [(NOW + TIME[k], joint_state(NOW + TIME[k], ["q3", "q1"], position=[levels[k], 0.1 * levels[k]])) for k in rows],
        "/servo/out/state": [(NOW + TIME[k] + 1e-4, joint_state(NOW + TIME[k], [], position=[0.0, X[k]])) for k in rows],
    }  # fmt: skip
    assert roles_of(foreign.write(tmp_path / "bag", topics))["output"] == "/servo/out/state position[1]"


def test_the_stamps_of_a_stream_are_times(tmp_path):
    lines = ["__time,/states/header/stamp,/states/joint0/position,/effort/data.0"]
    for k in range(0, 8000, 4):
        lines += [f"{NOW + TIME[k]:.4f},{NOW + TIME[k]:.4f},{X[k]:.9g},", f"{NOW + TIME[k] + 1e-3:.4f},,,{FORCE[k]:.9g}"]  # fmt: skip
    (tmp_path / "run.csv").write_text("\n".join(lines) + "\n")
    found = guess(tmp_path / "run.csv")
    assert found.inventory.clock.column == "__time" and "not used" not in found.signals


def test_the_refusal_of_stamps_that_rows_share_tells_of_the_rate(tmp_path):
    coarse = np.floor(TIME / 0.002) * 0.002
    np.savez(tmp_path / "run.npz", t=coarse, force=FORCE, x=X)
    with pytest.raises(InputError, match="coarse stamps; .* init --rate HZ"):
        guess(tmp_path / "run.npz")
    assert roles_of(tmp_path / "run.npz", rate=1000.0)["output"] == "x"


@pytest.mark.parametrize("word", ["con", "ctl", "ctr", "ctrl"])
def test_a_controllers_output_is_the_command_beside_the_torque_that_was_measured(tmp_path, word):
    names = {f"tau_{word}": FORCE, "pos_meas": X, "tau_meas": FORCE + 0.1 * OTHER}
    found = roles_of(table(tmp_path, **names))
    assert found == {"output": "pos_meas", "input": f"tau_{word}", "effort": "tau_meas"}


def test_the_force_of_a_contact_is_not_called_a_controllers_output(tmp_path):
    path = table(tmp_path, pos=X, force_con=FORCE)
    assert guess(path).roles.choices["input"].reason.startswith("an effort, and nothing else drives")


def test_of_efforts_the_one_that_a_sensor_read_comes_before_one_that_was_worked_out(tmp_path):
    path = table(tmp_path, pos=X, tau_fric=FORCE, tau_meas=FORCE + 0.3 * OTHER)
    choice = guess(path).roles.choices["input"]
    assert choice.recorded.column == "tau_meas"
    assert any("tau_fric" in doubt for doubt in choice.doubts)


@pytest.mark.parametrize(
    ("heads", "output"),
    [
        (("xAccl", "gyr_y"), "gyr_y"), (("accel_x", "u"), "accel_x"), (("acc_x", "zGyro"), "zGyro"), (("linacc", "u"), "linacc"),
        (("accX", "pos"), "pos"),
    ],
)  # fmt: skip
def test_abbreviations_of_accelerations_and_of_gyros_are_words(tmp_path, heads, output):
    found = guess(table(tmp_path, **{heads[0]: np.gradient(V, TIME), heads[1]: V})).roles
    assert found.choices["output"].recorded.column == output
    assert (
        found.output_kind
        == {"g": "velocity", "z": "velocity", "a": "acceleration", "l": "acceleration", "p": "position"}[
            output[0]
        ]
    )


def test_a_letter_beside_a_word_that_is_not_known_is_doubted(tmp_path):
    (doubt,) = guess(table(tmp_path, xBlorf=X, u=FORCE)).roles.choices["output"].doubts
    assert "'x'" in doubt and "'blorf'" in doubt
    assert not guess(table(tmp_path, x=X, u=FORCE)).roles.choices["output"].doubts


@pytest.mark.parametrize("unit", [1.0, 1e3, 1e9])
@pytest.mark.parametrize("name", ["clock_of_motor", "u", "t_cmd"])
def test_a_number_that_runs_like_a_clock_is_no_effort(tmp_path, name, unit):
    late = 0.02 * np.random.default_rng(0).random(len(TIME))
    clock = unit * (18792.0 + np.maximum.accumulate(TIME - late))
    assert roles_of(table(tmp_path, pos=X, force=FORCE, **{name: clock})) == {
        "output": "pos",
        "input": "force",
    }


def test_an_uptime_in_a_command_is_no_effort(tmp_path):
    rows = range(0, 8000, 4)
    topics = {
        "/motor_command": [(NOW + TIME[k], foreign.array([4711.0 + TIME[k], 0.5 * X[k]])) for k in rows],
        "/joint_states": [
            (NOW + TIME[k], joint_state(NOW + TIME[k], ["knee"], position=[X[k]])) for k in rows
        ],
    }
    found = roles_of(foreign.write(tmp_path / "bag", topics))
    assert "/motor_command data[0]" not in found.values()


def test_a_uniform_motion_and_an_effort_that_rises_are_no_clocks(tmp_path):
    rising = 0.4 * TIME
    found = roles_of(table(tmp_path, x=TIME + 0.001 * OTHER, torque=rising))
    assert found == {"output": "x", "input": "torque"}


@pytest.mark.parametrize(
    ("position", "velocity", "effort", "asked"),
    [
        ("posición", "velocidad", "corriente", "consigna_posición"),
        ("position", "vitesse", "couple", "consigne_position"),
        ("Winkel", "Geschwindigkeit", "Drehmoment", "Winkel_Soll"),
        ("posizione", "velocità", "coppia", "posizione_riferimento"),
        ("posição", "velocidade", "força", "referência_posição"),
    ],
)
def test_words_of_other_languages_mean_what_they_do(tmp_path, position, velocity, effort, asked):
    wanted = tones(2, TIME, 0.3, 0.2, 1.5)
    x, v, torque = servo(wanted)
    path = table(tmp_path, **{position: x, velocity: v, effort: torque, asked: wanted})
    assert roles_of(path) == {
        "output": position, "velocity": velocity, "effort": effort, "reference": asked,
    }  # fmt: skip


@pytest.mark.parametrize(
    ("output", "effort", "error"),
    [("Saída", "Esforço", "Erro"), ("salida", "esfuerzo", "error"), ("uscita", "sforzo", "errore")],
)
def test_an_effort_named_in_another_language_drives_an_output_named_in_it(tmp_path, output, effort, error):
    target = 1.5
    path = table(tmp_path, **{output: X, error: target - X, effort: 0.4 * FORCE})
    assert roles_of(path) == {"output": output, "input": effort}


@pytest.mark.parametrize("name", ["tiempo", "temps", "Zeit", "tempo (ms)"])
def test_a_time_is_known_in_other_languages(tmp_path, name):
    uneven = np.cumsum(np.random.default_rng(0).integers(1, 4, len(TIME)))  # ms
    np.savez(tmp_path / "run.npz", **{name: uneven, "pos": X, "force": FORCE})
    assert guess(tmp_path / "run.npz").inventory.clock.column == name


def staircase(rows: int = 2000) -> np.ndarray:
    """The width of a pulse [us] that rises in steps, as a test stand plays it."""
    return 1000.0 + 100.0 * (np.arange(rows) // (rows // 8))


def test_the_width_of_a_pulse_drives_and_the_volts_of_a_load_cell_do_not(tmp_path):
    time, width = 0.01 * np.arange(2000), staircase()
    rate = np.zeros(len(time))
    for k in range(len(time) - 1):
        rate[k + 1] = rate[k] + 0.01 * (width[k] - 1000.0 - rate[k]) / 0.3
    cell = 0.03 + 0.001 * np.random.default_rng(0).standard_normal(len(time))
    columns = {
        "Time (s)": time,
        "ESC signal (µs)": width,
        "Thrust Load Cell (mV)": cell,
        "Motor Speed (RPM)": rate,
    }
    np.savez(tmp_path / "run.npz", **columns)
    found = start([tmp_path / "run.npz"])
    roles = found.guess.roles.choices
    assert (
        str(roles["input"].recorded) == "ESC signal (µs)"
        and str(roles["output"].recorded) == "Motor Speed (RPM)"
    )
    assert "asked for" in roles["input"].reason


def test_the_effort_that_goes_best_with_the_output_is_doubted_where_it_hardly_does(tmp_path):
    noise = {
        name: np.random.default_rng(k).standard_normal(len(TIME))
        for k, name in enumerate(("torque_a", "torque_b"))
    }
    doubts = guess(table(tmp_path, pos=X, **noise)).roles.choices["input"].doubts
    assert any("it hardly goes with the output (coherence 0.0" in doubt for doubt in doubts)


def test_the_letter_of_an_array_of_named_signals_tells_nothing():
    assert words_of('Y[2]."Model Root"/"Switch2"/"Out1"') == words_of('"Model Root"/"Switch2"/"Out1"')
    assert words_of("q[2]") == ["q", "2"]


@pytest.mark.parametrize(
    ("name", "unit"),
    [
        ("curr_0", "A"),
        ("motor_current", "A"),
        ("torque_current", "A"),
        ("current_torque", ""),
        ("curr_force", ""),
        ("voltage_cmd", "V"),
    ],
)
def test_the_last_word_for_an_effort_says_its_unit(name, unit):
    assert force_unit_of(Recorded(name, TIME, FORCE, column=name)) == unit


@pytest.mark.parametrize("name", ["Entrada", "Estímulo", "Ingresso", "entrée", "Eingang"])
def test_a_column_called_an_input_in_another_language_drives(name: str, tmp_path: Path) -> None:
    time = 0.02 * np.arange(600)
    drive = np.where(time % 8.0 < 3.0, 2.0, 0.0)
    place = np.cumsum(np.cumsum(drive - 0.5)) * 4e-4
    path = tmp_path / "run.csv"
    columns = np.column_stack([time, drive, place])
    np.savetxt(path, columns, delimiter=",", header=f"t,{name},posicion", comments="", encoding="utf-8")
    assert guess(path).roles.choices["input"].recorded.said == name


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("Sollmoment", "soll moment"), ("Drehzahlsollwert", "drehzahl sollwert"), ("Positionsistwert", "position istwert"),
        ("Sollgelenkwinkel", "soll gelenk winkel"), ("Winkelgeschwindigkeit", "winkel geschwindigkeit"), ("Ankerstrom", "anker strom"),
        ("Stellgröße", "stell grosse"), ("motorcurrent", "motor current"), ("cmdvel", "cmd vel"), ("tauref", "tau ref"), ("qdes", "q des"),
        ("wheelspeed", "wheel speed"),
    ],
)  # fmt: skip
def test_words_that_are_written_as_one_are_several(name, words):
    assert words_of(name) == words.split()


@pytest.mark.parametrize(
    "name",
    ["test", "fact", "rectangle", "composition", "setpoint", "thetadot", "list", "moment", "recurrent"],
)
def test_a_word_that_only_ends_like_another_is_one(name):
    assert words_of(name) == [name]


def test_a_compound_says_who_asked_for_an_effort_and_which_one_was_measured(tmp_path):
    path = table(tmp_path, Sollmoment=FORCE, Istmoment=FORCE + 0.1 * OTHER, Gelenkwinkel=X)
    assert roles_of(path) == {"output": "Gelenkwinkel", "input": "Sollmoment", "effort": "Istmoment"}
    assert "hold: zero" in guess(table(tmp_path, Sollmoment=FORCE, Gelenkwinkel=X)).signals


def test_a_letter_of_what_a_controller_gives_out_is_an_axis_and_no_position(tmp_path):
    """Two tables of `rostopic echo -p`: points of which one is a place and the other what two motors were asked for."""
    path = table(tmp_path, **{"pose.field.point.z": X, "controls.field.point.x": FORCE})
    assert roles_of(path) == {"output": "pose.field.point.z", "input": "controls.field.point.x"}
