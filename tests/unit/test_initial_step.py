"""A step that was made with the first sample of a record is a change of the input: a machine at rest shows what was there before it."""

import numpy as np
import pytest

from rhythmid.identify.identify import identify
from rhythmid.identify.initial_step import value_before
from rhythmid.model import Model
from rhythmid.record.record import Channel, Hold, Record

STEP = 0.02
TIME = STEP * np.arange(150)
DELAY, LAG, GAIN = 0.063, 0.15, 0.5
MODEL = Model.from_text("inertia: {mass: {value: 1.0}}\nforce: [viscous_damper: {damping: {value: 1.0}}]")
SERVO = Model.from_text(
    "inertia: {mass: {value: 1.0, fixed: true}}\ncommand: [velocity_control: {gain: {value: 3.0}}]"
)
NOISE = np.random.default_rng(1).standard_normal(len(TIME))


def late_speed(size: float) -> np.ndarray:
    since = np.maximum(TIME - DELAY, 0.0)
    return size * (1.0 - np.exp(-since / LAG)) + 2e-4 * NOISE


def record(speed: np.ndarray, asked: np.ndarray, hold: Hold = "zero") -> Record:
    return Record(
        "step", Channel(TIME, speed, "m/s"), Channel(TIME, asked, "N"), hold=hold, output_kind="velocity"
    )


@pytest.mark.parametrize("hold", ["zero", "linear", "band_limited"])
def test_a_dead_time_shows_in_a_step_that_the_record_began_with(hold):
    found = identify(record(late_speed(10.0 * GAIN), np.full(len(TIME), 10.0), hold), MODEL)
    assert found.usable
    assert found.delays.sum.value == pytest.approx(DELAY, abs=2e-3)
    assert found.parameters["inertia.mass"].value == pytest.approx(LAG / GAIN, rel=0.02)


def test_a_reference_was_where_the_machine_rested_before_it_stepped():
    asked = Channel(TIME, np.full(len(TIME), 3.0), "m/s")
    stepped = Record(
        "step", Channel(TIME, late_speed(3.0), "m/s"), asked, input_kind="reference", output_kind="velocity"
    )
    assert value_before(stepped) == pytest.approx(0.0, abs=1e-3)
    found = identify(stepped, SERVO)
    assert found.delays.sum.value == pytest.approx(DELAY, abs=2e-3)


@pytest.mark.parametrize(
    ("speed", "asked"),
    [
        pytest.param(5.0 * np.exp(-TIME), np.full(len(TIME), 10.0), id="it runs already"),
        pytest.param(np.sin(TIME), np.cos(TIME), id="a wave that begins at its peak"),
        pytest.param(late_speed(5.0), np.zeros(len(TIME)), id="nothing is asked for"),
        pytest.param(late_speed(5.0), np.where(TIME < 1.0, 1.0, 9.0), id="a larger step comes later"),
    ],
)
def test_the_past_of_any_other_input_stays_as_it_was(speed, asked):
    assert value_before(record(speed, asked)) is None


def test_noise_and_rounding_of_a_position_do_not_hide_that_it_starts_from_rest():
    position = np.cumsum(late_speed(5.0)) * STEP
    asked = Channel(TIME, np.full(len(TIME), 10.0), "N")
    for seen in (position + 0.02 * NOISE, np.round(position / 0.02) * 0.02):
        assert value_before(Record("step", Channel(TIME, seen, "m"), asked)) == 0.0
    assert value_before(Record("step", Channel(TIME, 5.0 * TIME + 0.02 * NOISE, "m"), asked)) is None
