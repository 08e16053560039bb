"""Axes that are told apart by the first word of their columns: `Swing Pos` and `Swing Ms` are of the swing, `Boom Ms` of the boom."""

from pathlib import Path

import numpy as np
import pytest
from foreign import STEP, moved, roles_of, tones

from rhythmid.errors import InputError
from rhythmid.start.start import guess

FINE = np.arange(16000) * STEP
TIME = FINE[::5]
AXES = ("Boom", "Swing", "Stick")


def axis(seed: int, size: float) -> tuple[np.ndarray, np.ndarray]:
    """Position and drive of a mass on a spring."""
    force = size * tones(seed, FINE, 3.0, 0.3, 2.0)
    noise = 1e-4 * size * np.random.default_rng(seed).standard_normal(len(TIME))
    return moved(force, 0.5, 1.0, 5.0)[0][::5] + noise, force[::5] + noise


def table(folder: Path, position: str, drive: str = "Ms", without: tuple[str, ...] = ()) -> Path:
    """Columns of three axes, of which the first moves most."""
    columns = {"Time": TIME}
    made = {
        name: axis(seed, size) for seed, (name, size) in enumerate(zip(AXES, (1.0, 0.6, 0.4), strict=True))
    }
    columns |= {f"{name} {position}": moved_by for name, (moved_by, _) in made.items()}
    columns |= {f"{name} {drive}": force for name, (_, force) in made.items()}
    kept = {name: value for name, value in columns.items() if name not in without}
    rows = np.column_stack(list(kept.values()))
    np.savetxt(folder / "run.csv", rows, delimiter=",", header=",".join(kept), comments="")
    return folder / "run.csv"


@pytest.mark.parametrize("position", ["Pos", "Pos Sensor", "Cylinder Pos", "Pos [deg]"])
@pytest.mark.parametrize("wanted", ["Swing", "swing", "Boom"])
def test_an_axis_is_found_by_the_first_word_of_its_columns(tmp_path, position, wanted) -> None:
    source = table(tmp_path, position)
    name = wanted.capitalize()
    assert roles_of(source, joint=wanted) == {"output": f"{name} {position}", "input": f"{name} Ms"}


@pytest.mark.parametrize("position", ["Pos", "Pos Sensor"])
def test_without_a_wish_the_axis_that_moves_most_has_its_own_drive(tmp_path, position) -> None:
    assert roles_of(table(tmp_path, position)) == {"output": f"Boom {position}", "input": "Boom Ms"}


@pytest.mark.parametrize("position", ["Pos", "Pos Sensor"])
def test_no_number_of_another_axis_drives_one_that_has_none_of_its_own(tmp_path, position) -> None:
    source = table(tmp_path, position, without=("Swing Ms",))
    assert roles_of(source, joint="Swing") == {"output": f"Swing {position}"}


@pytest.mark.parametrize("wanted", [None, "Swing"])
def test_axes_of_which_no_motion_was_recorded_are_axes(tmp_path, wanted) -> None:
    source = table(tmp_path, "Pos", without=("Boom Pos", "Stick Pos"))
    assert roles_of(source, joint=wanted) == {"output": "Swing Pos", "input": "Swing Ms"}
    assert not guess(source, joint=wanted).roles.choices["input"].others


def test_of_an_axis_that_was_asked_for_nothing_of_those_drives(tmp_path) -> None:
    source = table(tmp_path, "Pos", without=("Boom Pos", "Stick Pos", "Swing Ms"))
    assert roles_of(source, joint="Swing") == {"output": "Swing Pos"}


def test_a_first_word_of_several_joints_is_refused(tmp_path) -> None:
    columns = {"Time": TIME, "Swing Left Pos": axis(0, 1.0)[0], "Swing Up Pos": axis(1, 0.5)[0]}
    rows = np.column_stack(list(columns.values()))
    np.savetxt(tmp_path / "run.csv", rows, delimiter=",", header=",".join(columns), comments="")
    with pytest.raises(InputError, match="no joint is called 'Swing'; it has swing_left, swing_up"):
        guess(tmp_path / "run.csv", joint="Swing")


def machine_tool(folder: Path, letters: tuple[str, ...]) -> Path:
    """Columns of a spindle, which moves most, and of axes that are called by letters."""
    columns = {"Time": TIME}
    for seed, name in enumerate(("S1", *(f"{letter}1" for letter in letters))):
        position, force = axis(seed, 1.0 / (1.0 + seed))
        columns |= {f"{name}_ActualPosition": position, f"{name}_CurrentFeedback": force}
    rows = np.column_stack(list(columns.values()))
    np.savetxt(folder / "run.csv", rows, delimiter=",", header=",".join(columns), comments="")
    return folder / "run.csv"


@pytest.mark.parametrize(("wanted", "name"), [(None, "S1"), ("X", "X1"), ("y", "Y1")])
def test_the_axes_of_a_machine_tool_are_called_by_their_letters(tmp_path, wanted, name) -> None:
    source = machine_tool(tmp_path, ("X", "Y", "Z"))
    assert roles_of(source, joint=wanted) == {
        "output": f"{name}_ActualPosition",
        "input": f"{name}_CurrentFeedback",
    }


def test_the_letters_of_a_vector_are_no_axes(tmp_path) -> None:
    """A vector has one quantity."""
    columns = {
        "Time": TIME,
        **{f"tip position {letter}": axis(seed, 1.0)[0] for seed, letter in enumerate("xyz")},
    }
    columns["motor current"] = axis(0, 1.0)[1]
    rows = np.column_stack(list(columns.values()))
    np.savetxt(tmp_path / "run.csv", rows, delimiter=",", header=",".join(columns), comments="")
    assert not {"x", "y", "z"} & set(guess(tmp_path / "run.csv").roles.joint.motion)


def test_the_output_is_a_motion_of_the_joint_that_was_asked_for(tmp_path) -> None:
    """Not that of the motor, which is of no joint and moves more."""
    columns = {"Time": TIME, "motor position": axis(0, 1.0)[0], "tip position z": axis(1, 0.1)[0]}
    rows = np.column_stack(list(columns.values()))
    np.savetxt(tmp_path / "run.csv", rows, delimiter=",", header=",".join(columns), comments="")
    assert (
        guess(tmp_path / "run.csv", joint="tip").roles.choices["output"].recorded.column == "tip position z"
    )
