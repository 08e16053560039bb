"""A law of the time is told from a static one only where the drive passes a level twice in the same direction."""

import numpy as np
import pytest
from scipy.signal import resample

from rhythmid.diagnose.effort.scales import scales_of
from rhythmid.elements.candidates import STEADY, candidates
from rhythmid.elements.catalogue import load_catalogue
from rhythmid.identify.drive_changes import most_repeated
from rhythmid.identify.inverse_dynamics.balance import Balance
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
    ("drive", "count"),
    [
        ([1.0, 1.0, 1.0], 0),
        ([0.0, 0.0, 2.0, 2.0], 1),
        ([0.0, 1.0, 2.0, 2.0, 3.0], 1),
        ([0.0, 1.0, 0.0, -1.0, 0.0], 1),
        ([0.0, 1.0, 0.0, 1.0], 2),
        ([0.0, 5.0, 4.8, 5.0, 4.8, 5.0], 3),
        (pulses(1.0), 1),
        (pulses(1.0, 5.0), 2),
        ([0.0], 0),
    ],
    ids=["constant", "step", "stairs", "either way", "twice", "about a point", "pulse", "pulses", "short"],
)
def test_only_a_level_that_is_passed_again_in_the_same_direction_counts(drive, count):
    assert most_repeated([("run", np.array(drive), True)]) == count


def test_parts_of_one_record_count_together_and_records_apart():
    there, back = np.array([0.0, 1.0]), np.array([1.0, 0.0])
    assert most_repeated([("run", there, True), ("run", back, True), ("run", there, True)]) == 2
    assert most_repeated([("one", there, True), ("other", there, True)]) == 1


def test_the_ringing_of_an_interpolated_step_is_no_change():
    step = np.where(np.arange(400) < 200, 0.0, 1.0)
    ringing = resample(np.concatenate([step, step[::-1]]), 3200)[:1600]
    assert most_repeated([("run", ringing, True)]) > 2
    assert most_repeated([("run", ringing, False)]) == 1
    late = np.full(100, 1.0) + 1e-15 * (-1.0) ** np.arange(100)
    assert most_repeated([("run", ringing, False), ("run", late, False)]) == 1


@pytest.mark.parametrize(("begins", "tried"), [((1.0,), False), ((1.0, 5.0), True)], ids=["one", "two"])
@pytest.mark.parametrize("hold", ["zero", "linear", "band_limited"])
def test_one_pulse_shows_no_delay_gain_or_clock_that_changes_with_time(begins, tried, hold):
    force = pulses(*begins)
    speed, place, kept = 0.0, 0.0, []
    for one in force:
        kept.append(place)
        speed += 0.02 * (one - 5.0 * speed)
        place += 0.02 * speed
    record = Record("run", Channel(TIME, np.array(kept), "m"), Channel(TIME, force, "N"), hold=hold)
    found = candidates(load_catalogue(), MODEL.setting, scales(prepare([record]), MODEL))
    assert (DRIFTS <= {element.name for element, _ in found.tried}) == tried
    assert tried or DRIFTS <= {name for name, reason in found.not_tried.items() if reason == STEADY}


def test_in_the_balance_of_forces_one_pulse_shows_no_gain_that_fades():
    for begins, tried in (((1.0,), False), ((1.0, 5.0), True)):
        force, kept, place, speed = pulses(*begins), [], 0.0, 0.0
        for one in force:
            kept.append(place)
            speed += 0.02 * (one - 5.0 * speed)
            place += 0.02 * speed
        noise = 1e-5 * np.random.default_rng(0).standard_normal(len(TIME))
        record = Record("run", Channel(TIME, np.array(kept) + noise, "m"), Channel(TIME, force, "N"))
        found = candidates(load_catalogue(), MODEL.setting, scales_of(Balance.of([record], MODEL), MODEL))
        assert ("actuator_fade" in {element.name for element, _ in found.tried}) == tried
