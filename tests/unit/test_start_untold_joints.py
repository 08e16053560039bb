"""Joints of which no name says a quantity: what is asked for and measured of each is its motion, and another one's is no effort."""

from pathlib import Path

import foreign
import numpy as np
import pytest
from foreign import roles_of, servo, tones

from rhythmid.errors import InputError
from rhythmid.start.start import guess

FINE = np.arange(16000) * foreign.STEP
TIME = FINE[::20]
LEGS = ("FR_1", "FR_2", "FL_1", "FL_2")


def legs(asked: str, measured: str) -> dict[str, np.ndarray]:
    """Target and position of the joints of a robot that go along with each other, by the patterns of their columns."""
    columns: dict[str, np.ndarray] = {}
    common = tones(1, FINE, 0.3, 0.2, 1.5)
    for number, name in enumerate(LEGS):
        target = (1.0 + 0.1 * number) * common + 0.3 * tones(2 + number, FINE, 0.3, 0.2, 1.5)
        noise = 1e-3 * np.random.default_rng(number).standard_normal(len(TIME))
        position = servo(target)[0][::20] + noise
        columns |= {
            asked.format(name=name, number=number): target[::20],
            measured.format(name=name, number=number): position,
        }
    return columns


def table(folder: Path, columns: dict[str, np.ndarray]) -> Path:
    path = folder / "run.csv"
    columns = {"t": TIME, **columns}
    np.savetxt(
        path, np.column_stack(list(columns.values())), delimiter=",", header=",".join(columns), comments=""
    )
    return path


@pytest.mark.parametrize("wanted", ["FR_2", "fr_2", "FR_2_joint", "joint_FR_2"])
def test_a_joint_of_targets_and_actual_values_may_be_asked_for(tmp_path: Path, wanted: str) -> None:
    source = table(tmp_path, legs("{name}_target", "{name}_actual"))
    assert roles_of(source, joint=wanted) == {"output": "FR_2_actual", "input": "FR_2_target"}


def test_without_a_wish_no_other_joints_position_is_an_effort(tmp_path: Path) -> None:
    source = table(tmp_path, legs("{name}_target", "{name}_actual"))
    found = guess(source).roles
    assert set(found.choices) == {"output", "input"} and found.input_kind == "reference"
    assert found.rotary and len(found.joint.others) == len(LEGS) - 1


def test_a_joint_that_is_not_there_is_refused_with_those_that_are(tmp_path: Path) -> None:
    source = table(tmp_path, legs("{name}_target", "{name}_actual"))
    with pytest.raises(InputError, match="no joint is called 'RR_2'; it has fr_1, fr_2, fl_1, fl_2"):
        guess(source, joint="RR_2")


def test_entries_of_one_array_are_one_quantity_of_several_joints(tmp_path: Path) -> None:
    source = table(tmp_path, legs("action[{number}]", "observation.state[{number}]"))
    roles = roles_of(source, joint="2")
    assert roles == {"output": "observation.state[2]", "input": "action[2]"}


def test_without_what_was_asked_for_entries_of_one_array_drive_nothing(tmp_path: Path) -> None:
    columns = legs("action[{number}]", "observation.state[{number}]")
    measured = {name: value for name, value in columns.items() if name.startswith("observation")}
    assert set(roles_of(table(tmp_path, measured))) == {"output"}
