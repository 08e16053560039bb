"""What the user says of channels is taken as said, and needs no guess."""

from pathlib import Path

import numpy as np
import pytest
from foreign import array, joint_state, write

from rhythmid.errors import InputError
from rhythmid.record.read import read_record
from rhythmid.record.signals import Signals
from rhythmid.start.start import start
from rhythmid.start.stated import Stated

TIME = 0.01 * np.arange(1500)
SMALL, LARGE = 0.05 * np.sin(4.0 * TIME), 30.0 * np.sin(2.9 * TIME + 1.0)
PUSH = 3.0 * np.sin(1.9 * TIME) + np.cos(5.1 * TIME)


@pytest.fixture
def table(tmp_path) -> Path:
    """Columns whose names say nothing; the second one moves most."""
    path = tmp_path / "run.csv"
    rows = np.column_stack([TIME, SMALL, LARGE, PUSH])
    np.savetxt(path, rows, delimiter=",", header="t,p1,p2,c", comments="")
    return path


def begun(table: Path, *roles: str, units: tuple[str, ...] = ()):
    return start([table], stated=Stated.of(roles, units))


def test_stated_roles_come_before_every_guess(table):
    found = begun(table, "output=p1", "input=c")
    roles = found.guess.roles
    assert {role: choice.recorded.column for role, choice in roles.choices.items()} == {
        "output": "p1",
        "input": "c",
    }
    assert all(choice.reason.endswith("it was stated") for choice in roles.choices.values())
    assert begun(table, "output=p2").guess.roles.choices["output"].recorded.column == "p2"


@pytest.mark.parametrize(
    ("role", "kind"), [("reference", "reference"), ("base", "base_displacement"), ("input", "force")]
)
def test_a_stated_driver_has_the_kind_of_its_role(table, role, kind):
    roles = begun(table, "output=p1", f"{role}=c").guess.roles
    assert (roles.input_kind, roles.choices["input"].recorded.column) == (kind, "c")
    assert not any("taken for" in doubt for doubt in roles.choices["input"].doubts)


def test_a_stated_unit_is_that_of_the_record(table):
    found = begun(table, "output=p2", "input=c", units=("p2=deg", "c=N*m"))
    record = read_record(table, Signals.from_text(found.signals))
    np.testing.assert_allclose(record.output.value, np.radians(LARGE), rtol=1e-6)
    assert (record.output.unit, record.input.unit) == ("rad", "N*m")
    assert "no unit is stated" not in found.signals


def test_a_stated_output_of_a_bag_names_its_joint(tmp_path):
    states = [
        (at, joint_state(at, ["hip", "knee"], position=[far, near]))
        for at, far, near in zip(TIME, LARGE, SMALL, strict=True)
    ]
    commands = [(at, array([0.1, push])) for at, push in zip(TIME, PUSH, strict=True)]
    bag = write(tmp_path / "bag", {"/joint_states": states, "/commands": commands})
    roles = begun(bag, "output=/joint_states position[knee]", "input=/commands data[1]").guess.roles
    assert roles.joint.name == "knee"
    assert str(roles.choices["input"].recorded) == "/commands data[1]"
    with pytest.raises(
        InputError, match=r"/commands data\[0\] never changes, so that it cannot be the input"
    ):
        begun(bag, "input=/commands data[0]")


@pytest.mark.parametrize(
    ("roles", "units", "words"),
    [
        (("output",), (), "'output' is not  ROLE=CHANNEL"),
        (("motion=p1",), (), "--role motion=p1: a role is one of output, input, reference, base, forcing"),
        (("output=p1", "output=p2"), (), "a role is given twice"),
        (("output=p9",), (), "no channel is called 'p9' .* it has p1, p2, c"),
        (("input=p1",), ("p1=mm",), "p1 is in m, which is no force; say  reference=p1"),
        ((), ("p1",), "'p1' is not  CHANNEL=UNIT"),
        ((), ("p1=furlong",), "the unit is not known"),
    ],
)
def test_what_cannot_be_meant_is_refused_in_one_line(table, roles, units, words):
    with pytest.raises(InputError, match=words) as error:
        begun(table, *roles, units=units)
    assert "\n" not in str(error.value)
