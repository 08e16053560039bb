"""In a motion of one direction an end stop is told from friction only where the drive presses the machine against it."""

import numpy as np
import pytest
from axes import CATALOGUE, axis_model

from rhythmid.diagnose.effort.scales import scales_of
from rhythmid.elements.candidates import UNPRESSED, candidates
from rhythmid.identify.inverse_dynamics.balance import Balance
from rhythmid.identify.record_scales import scales
from rhythmid.identify.series import prepare
from rhythmid.record.pressed import some_part_is_pressed
from rhythmid.record.record import Channel, Record

STEP = 0.01
TIME = STEP * np.arange(1200)


def motion(off: float, stop: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Position, speed and force of 1 kg with 1 N s/m and 0.3 N of friction, under 2 N until `off` [s], with a stop at `stop` [m]."""
    force = np.where((TIME > 0.5) & (TIME < off), 2.0, 0.0)
    x, v, kept = 0.0, 0.0, []
    for one in force:
        kept.append((x, v))
        v = max(v + STEP * (one - v - 0.3), 0.0)
        x = min(x + STEP * v, stop)
        v = 0.0 if x == stop else v
    position, speed = np.array(kept).T
    return position, speed, force


@pytest.mark.parametrize(
    ("off", "stop", "pressed"),
    [(6.0, np.inf, False), (12.0, 5.0, True), (6.0, 5.0, True), (12.0, np.inf, False)],
    ids=["coasts", "pressed", "pressed for a while", "drives on"],
)
@pytest.mark.parametrize("side", [1.0, -1.0])
def test_a_machine_that_its_drive_holds_at_an_end_is_pressed(off, stop, pressed, side):
    position, speed, force = motion(off, stop)
    assert some_part_is_pressed([(side * position, side * speed, side * force)]) == pressed


def test_the_ripple_of_a_drive_that_is_switched_off_presses_nothing():
    position, speed, force = motion(6.0, np.inf)
    late = TIME > 6.0
    coast = (position[late], speed[late], np.full(late.sum(), 1e-15))
    assert not some_part_is_pressed([(position, speed, force), coast])


@pytest.mark.parametrize(("off", "stop"), [(6.0, np.inf), (12.0, 5.0)], ids=["coasts", "pressed"])
def test_an_end_stop_is_tried_in_a_motion_of_one_direction_where_it_presses(off, stop):
    position, _, force = motion(off, stop)
    noise = 1e-5 * np.random.default_rng(0).standard_normal(len(TIME))
    record = Record("run", Channel(TIME, position + noise, "m"), Channel(TIME, force, "N"))
    model, pressed = axis_model(), np.isfinite(stop)
    balance = Balance.of([record], model)
    for sizes in (scales(prepare([record]), model), scales_of(balance, model)):
        found = candidates(CATALOGUE, model.setting, sizes)
        assert ("end_stop_contact" in {one.name for one, _ in found.tried}) == pressed
        assert pressed or found.not_tried["end_stop_contact"] == UNPRESSED
        assert "coulomb_friction" in {one.name for one, _ in found.tried}
