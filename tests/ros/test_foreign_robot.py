"""A robot of another make, moved by MuJoCo: over its own topics, types and rates the answer is the same as on our own plant."""

import pytest
from foreign_robot import EFFECTS, answer, judge, record, true_delay
from patience import LONG

from machines import only

LENGTH = 3.0  # s of each of two excitations
# what could be mistaken for what is concealed, or found where there is nothing; the whole catalogue is in tests/proof
LAWS = only(
    "end_stop_contact", "coulomb_friction", "cubic_stiffness", "bilinear_stiffness", "position_dependent_damping", "quadratic_drag",
    "freeplay", "command_lag", "actuator_lag", "actuator_saturation", "sensor_lag", "sensor_gain",
)  # fmt: skip
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
    found, delay = answer(tmp_path / "bag", command_type, LAWS), true_delay(tmp_path / "bag", acted)
    assert judge(EFFECTS[effect], found, delay, SIGMAS) == []
