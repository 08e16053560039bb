"""An output that comes before its reference is told, and no servo, however fast, is accused of it."""

from dataclasses import replace

import numpy as np
import pytest

from rhythmid.diagnose.admission import admitted
from rhythmid.identify.early_output import early_output
from rhythmid.identify.identify import identify
from rhythmid.model import Model
from rhythmid.record.record import Channel, Record
from rhythmid.simulation.signal import zero_order_hold
from rhythmid.simulation.simulate import simulate

RATE = 200.0


def servo(proportional: float, derivative: float) -> Model:
    return Model.from_text(
        "inertia: {mass: {value: 1.0, unit: kg, fixed: true}}\n"
        f"command: [position_control: {{proportional: {{value: {proportional}}}, derivative: {{value: {derivative}}}}}]\n"
        "force: [viscous_damper: {damping: {value: 0.5, unit: N*s/m, fixed: true}}]"
    )


def waves(lines: int) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(7)
    time = np.arange(0.0, 20.0, 1.0 / RATE)
    frequency = np.linspace(0.3, 2.0, lines) if lines > 1 else np.array([0.8])
    return time, np.sin(2.0 * np.pi * frequency[:, None] * time + rng.uniform(0.0, 6.0, lines)[:, None]).sum(
        axis=0
    )


def followed(model: Model, lines: int = 8) -> Record:
    """20 s of a servo that follows a sum of sines, with noise."""
    time, asked = waves(lines)
    moved = simulate(model, time, zero_order_hold(time, asked), None, (0.0, 0.0)).output
    moved = moved + 1e-2 * np.std(moved) * np.random.default_rng(1).standard_normal(len(time))
    return Record(
        "servo", Channel(time, moved, "m"), Channel(time, asked, "m"), hold="zero", input_kind="reference"
    )


def exchanged(record: Record) -> Record:
    assert record.input is not None
    return replace(record, output=record.input, input=record.output)


@pytest.mark.parametrize("lines", [1, 8])
@pytest.mark.parametrize(("proportional", "derivative"), [(50.0, 3.0), (400.0, 25.0), (4e4, 400.0)])
def test_a_servo_answers_after_it_is_asked(proportional, derivative, lines):
    assert early_output(followed(servo(proportional, derivative), lines)) is None


def test_the_time_is_told_by_which_an_output_comes_before_its_reference():
    time, asked = waves(8)
    late = np.interp(time - 0.03, time, asked)
    record = Record("log", Channel(time, asked, "m"), Channel(time, late, "m"), input_kind="reference")
    said = early_output(record)
    assert said is not None and "before the reference" in said and "exchanged" in said
    assert float(said.partition("comes ")[2].partition(" ")[0]) == pytest.approx(30.0, abs=0.5)


def test_identify_and_diagnose_tell_it_of_exchanged_channels():
    record = exchanged(followed(servo(50.0, 3.0)))
    assert any("before the reference" in note for note in identify(record, servo(50.0, 3.0)).notes)
    assert any("before the reference" in note for note in admitted([record], (), servo(50.0, 3.0)).notes)
