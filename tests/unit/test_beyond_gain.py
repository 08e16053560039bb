"""An actuator's law on the efforts that were recorded: on two levels of one size it is a gain, and explains nothing."""

import math
from dataclasses import replace

import numpy as np
import pytest
from axes import CATALOGUE, axis, axis_model

from rhythmid.diagnose.effort.beyond_gain import beyond_gain, recorded_efforts
from rhythmid.diagnose.effort.scales import scales_of
from rhythmid.diagnose.effort.search import search_effort
from rhythmid.identify.inverse_dynamics.balance import Balance
from rhythmid.record.record import Channel, Record

LAW = CATALOGUE["actuator_nonlinearity"]
COEFFICIENT = 0.02  # of a cubic law, per square of the effort
SWEPT = 4.0 * np.sin(np.linspace(0.0, 2.0 * np.pi, 1000, endpoint=False))


def switched_axis(seed: int = 0) -> Record:
    """An axis of 1 kg with 2 N s/m and 0.8 N of Coulomb friction between two places where its force of 4 N changes sign, sampled at
    150 Hz."""
    step, every, count = 1e-4, 67, 200_000
    x = v = 0.0
    force, kept = 4.0, []
    for index in range(count):
        if index % every == 0:
            force = -4.0 if x > 0.1 else 4.0 if x < -0.1 else force
            kept.append((index * step, x, force))
        v += step * (force - 2.0 * v - 0.8 * math.tanh(v / 1e-3))
        x += step * v
    time, position, effort = np.array(kept).T
    position = position + 1e-5 * np.random.default_rng(seed).standard_normal(len(time))
    return Record("switched", Channel(time, position, "m"), Channel(time, effort, "N"))


@pytest.fixture(scope="module")
def balance() -> Balance:
    return Balance.of([switched_axis()], axis_model())


def share(balance: Balance, recorded: np.ndarray, required: np.ndarray) -> float:
    model = axis_model().with_element(LAW, {"coefficient": COEFFICIENT})
    return beyond_gain(model, "actuator_nonlinearity", scales_of(balance, model), recorded, required)


def test_a_cubic_law_of_efforts_of_one_size_is_a_gain(balance):
    assert share(balance, np.tile([4.0, -4.0, 0.0], 100), SWEPT) < 1e-20


def test_efforts_that_are_recorded_as_the_model_requires_them_show_a_law(balance):
    assert share(balance, SWEPT, SWEPT) == pytest.approx(1.0)
    assert share(balance, 0.5 * SWEPT, SWEPT) == pytest.approx(0.5**6)  # the cube of half, squared


def test_a_fading_actuator_is_no_law_of_the_effort(balance):
    model = axis_model().with_element(CATALOGUE["actuator_fade"], {"rate": 0.01})
    found = beyond_gain(model, "actuator_fade", scales_of(balance, model), np.tile([4.0, -4.0], 100), SWEPT)
    assert found == math.inf


def test_a_forcing_beside_the_recorded_effort_leaves_its_levels_unknown():
    record = switched_axis()
    assert recorded_efforts([record], axis_model()) is not None
    forced = replace(record, forcing=Channel(record.output.time, np.sin(record.output.time), "N"))
    assert recorded_efforts([forced], axis_model()) is None


def test_no_law_of_the_actuator_explains_a_switched_effort():
    found = search_effort([switched_axis()], axis_model(), CATALOGUE, most=1)
    assert "friction" in found.chosen.elements[0]
    laws = {"actuator_nonlinearity", "actuator_deadband", "actuator_saturation"}
    assert not laws & {label for one in found.hypotheses for label in one.elements}


def test_a_dead_band_of_the_actuator_is_still_found():
    names = ("actuator_deadband", "viscous_damper")
    only = CATALOGUE.without(*(name for name in CATALOGUE if name not in names))
    record = with_dead_band(axis(friction=0.0, length=10.0), 0.5)
    found = search_effort([record], axis_model(), only, most=1)
    assert found.chosen.elements == ("actuator_deadband",)
    assert found.chosen.shape["more_than_gain"] > 0.8


def with_dead_band(record: Record, width: float) -> Record:
    """The record of the same motion, had its actuator a dead band [N]: its effort had to be larger by that."""
    assert record.input is not None
    effort = record.input.value + width * np.sign(record.input.value)
    return replace(record, input=replace(record.input, value=effort))


def test_every_hypothesis_with_a_law_of_the_actuator_is_looked_at():
    found = search_effort([switched_axis()], axis_model(), CATALOGUE, most=3)
    for one in found.hypotheses:
        terms = [term for label in one.elements if (term := one.fit.model.term(label)) is not None]
        assert ("more_than_gain" in one.shape) is any(term.element.slot == "actuator" for term in terms)
    assert found.ruled_out
