"""A robot of another make, moved by MuJoCo: over its own topics, types and rates the answer is the same as on our own plant."""

import pytest
from foreign_robot import EFFECTS, answer, judge, record, true_delay
from patience import LONG

LENGTH = 3.0  # s of each of two excitations
SIGMAS = 4.0  # a test that fails once in ten thousand runs
pytestmark = pytest.mark.timeout(LONG)


@pytest.mark.parametrize(
    ("effect", "command_type"),
    [
        ("nothing", "Float64MultiArray"),
        # test_realtime_delays finds delays, and test_excitation speaks this type
        pytest.param("delay", "Float64", marks=pytest.mark.long),
        ("floor", "JointState"),
    ],
)
def test_what_is_concealed_in_it_is_named_and_nothing_else(domain, tmp_path, effect, command_type):
    acted = record(tmp_path / "bag", EFFECTS[effect].parameters, LENGTH, command_type)
    found, delay = answer(tmp_path / "bag", command_type), true_delay(tmp_path / "bag", acted)
    assert judge(EFFECTS[effect], found, delay, SIGMAS) == []
