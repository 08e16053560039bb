"""Joint states whose entries have no names, beside what was asked for of the same joints by name."""

from pathlib import Path

import foreign
import numpy as np
import pytest
from foreign import joint_state, roles_of, servo, tones

from rhythmid.start.start import guess

TIME = np.arange(12_000) * foreign.STEP
ROWS = range(0, 12_000, 20)
NOW = 1.7e9
JOINTS = ("pivot", "shoulder", "elbow")


def bag(folder: Path, asked: str, names: tuple[str, ...] = JOINTS, size: float = 1.0) -> Path:
    """Two servos, of which the last moves more, their states without names, and what was asked for of all three by name on topic `asked`."""
    wanted = [np.full(len(TIME), 0.1), 0.3 * tones(4, TIME, 0.3, 0.2, 1.5), tones(2, TIME, 0.3, 0.2, 1.5)]
    moved = [wanted[0], servo(wanted[1])[0], servo(wanted[2])[0]]
    topics = {
        asked: [(NOW + TIME[k], joint_state(NOW + TIME[k], list(names), position=[size * one[k] for one in wanted])) for k in ROWS],
        "/servo/out/state": [(NOW + TIME[k] + 1e-4, joint_state(NOW + TIME[k], [], position=[one[k] for one in moved])) for k in ROWS],
    }  # fmt: skip
    return foreign.write(folder / "bag", topics)


@pytest.mark.parametrize("asked", ["/servo/in/references/joint_references", "/setpoints", "/goals"])
def test_an_entry_without_a_name_is_of_the_joint_that_stands_in_its_place_in_the_other_list(tmp_path, asked):
    source = bag(tmp_path, asked)
    assert roles_of(source) == {"output": "/servo/out/state position[2]", "input": f"{asked} position[elbow]"}
    assert guess(source).roles.joint.name == "elbow"
    assert roles_of(source, joint="shoulder") == {
        "output": "/servo/out/state position[1]",
        "input": f"{asked} position[shoulder]",
    }


def test_lists_of_another_length_tell_no_joint(tmp_path):
    topics = {
        "/asked": [(NOW + TIME[k], joint_state(NOW + TIME[k], ["elbow"], position=[0.2 * TIME[k] % 1.0])) for k in ROWS],
        "/servo/out/state": [(NOW + TIME[k], joint_state(NOW + TIME[k], [], position=[0.0, np.sin(TIME[k])])) for k in ROWS],
    }  # fmt: skip
    found = guess(foreign.write(tmp_path / "bag", topics))
    assert str(found.roles.choices["output"].recorded) == "/servo/out/state position[1]"


def test_what_is_of_the_same_joint_is_named_first_where_nothing_drives(tmp_path):
    source = bag(
        tmp_path, "/controller/out", size=0.02
    )  # what it is nobody says, nor is it of the motion's size
    (note,) = [line for line in guess(source).lines() if "nothing is taken to drive the machine" in line]
    assert note.split(": ")[1].startswith("/controller/out position[elbow]")
