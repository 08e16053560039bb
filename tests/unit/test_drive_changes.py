"""A law of the time is told from a static one only where the drive changes twice in the same direction."""

import numpy as np
import pytest

from rhythmid.elements.candidates import STEADY, candidates
from rhythmid.elements.catalogue import load_catalogue
from rhythmid.identify.drive_changes import rises_and_falls
from rhythmid.identify.record_scales import scales
from rhythmid.identify.series import prepare
from rhythmid.model import Model
from rhythmid.record.record import Channel, Record

TIME = 0.02 * np.arange(500)
MODEL = Model.from_text("inertia: {mass: 1.0}\nforce: [viscous_damper: {damping: 5.0}]")
DRIFTS = {"actuator_fade", "clock_skew", "input_delay_drift"}
EDGES = [0.0, 0.5, 1.5, 2.0]  # of a trapezoid, in s


def pulses(*begins: float) -> np.ndarray:
    """Trapezoids of 3 N with ramps of half a second."""
    return sum(
        (np.interp(TIME - begin, EDGES, [0.0, 3.0, 3.0, 0.0]) for begin in begins), np.zeros(len(TIME))
    )


@pytest.mark.parametrize(
    ("drive", "counts"),
    [
        ([1.0, 1.0, 1.0], (0, 0)),
        ([0.0, 0.0, 2.0, 2.0], (1, 0)),
        ([0.0, 1.0, 2.0, 2.0, 3.0], (2, 0)),
        ([0.0, 1.0, 0.0, 1.0], (2, 1)),
        (pulses(1.0), (1, 1)),
        (pulses(1.0, 5.0), (2, 2)),
        ([0.0], (0, 0)),
    ],
)
def test_a_ramp_is_one_change_and_rises_and_falls_are_counted_apart(drive, counts):
    assert rises_and_falls(np.array(drive)) == counts


@pytest.mark.parametrize(("begins", "tried"), [((1.0,), False), ((1.0, 5.0), True)], ids=["one", "two"])
def test_one_pulse_shows_no_delay_gain_or_clock_that_changes_with_time(begins, tried):
    force = pulses(*begins)
    speed, place, kept = 0.0, 0.0, []
    for one in force:
        kept.append(place)
        speed += 0.02 * (one - 5.0 * speed)
        place += 0.02 * speed
    record = Record("run", Channel(TIME, np.array(kept), "m"), Channel(TIME, force, "N"))
    found = candidates(load_catalogue(), MODEL.setting, scales(prepare([record]), MODEL))
    assert (DRIFTS <= {element.name for element, _ in found.tried}) == tried
    assert tried or DRIFTS <= {name for name, reason in found.not_tried.items() if reason == STEADY}
