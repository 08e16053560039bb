"""Effects in a chain: their order is part of the model, and is found from the records."""

from dataclasses import replace

import numpy as np
import pytest

from machines import CATALOGUE, SHORT, hopper, records
from rhythmid.diagnose.search.order import in_best_order, other_orders
from rhythmid.diagnose.search.trial import Trial
from rhythmid.identify.noise import NoiseModel
from rhythmid.identify.output_error import estimate
from rhythmid.identify.series import prepare
from rhythmid.model import Model

NOISE = NoiseModel(np.empty(0), 0.5e-4)  # of averages of four samples
VALUES = {
    "actuator_saturation": {"limit": 0.9},
    "actuator_lag": {"time_constant": 0.04},
    "actuator_fade": {"rate": 0.005},
}


def chained(*names: str) -> Model:
    model = hopper()
    for name in names:
        model = model.with_element(CATALOGUE[name], VALUES[name])
    return model


def order(model: Model) -> list[str]:
    return [term.label for term in model.terms if term.element.slot == "actuator"]


def trial_of(model: Model, added: tuple[str, ...], series, iterations: int = 30) -> Trial:
    fit = estimate(model, series, noise=NOISE, max_step=1e-3, iterations=iterations)
    return Trial(
        added, fit.model, fit.starts, fit.chi2, fit.samples, len(fit.names), True, fit.noise, fit.differences
    )


def test_an_effect_is_put_to_every_other_place_of_its_chain_and_the_others_stay():
    names = ("actuator_saturation", "actuator_lag", "actuator_fade")
    model = chained(*names)
    assert [order(other) for other in other_orders(model, "actuator_fade")] == [
        ["actuator_fade", "actuator_saturation", "actuator_lag"],
        ["actuator_saturation", "actuator_fade", "actuator_lag"],
    ]
    for other in other_orders(model, "actuator_saturation"):
        assert order(other) != list(names)
        assert other.parameters == {**other.parameters, **model.parameters}
    assert {order(other)[-1] for other in other_orders(model, "actuator_saturation")} == {
        "actuator_fade",
        "actuator_saturation",
    }


@pytest.mark.parametrize("name", ["linear_spring", "input_delay", "measurement_delay", "actuator_lag"])
def test_forces_that_add_and_delays_and_what_stands_alone_have_no_order(name):
    assert list(other_orders(chained("actuator_lag"), name)) == []


@pytest.mark.parametrize(
    "true", [("actuator_saturation", "actuator_lag"), ("actuator_lag", "actuator_saturation")]
)
def test_a_limit_before_a_lag_is_told_from_one_behind_it(true):
    machine = chained(*true)
    series = prepare(records(machine, SHORT[:2]), 4)
    for added in (true, true[::-1]):
        begin = trial_of(chained(*added), added, series)
        found = in_best_order(begin, series, NOISE, 1e-3)
        assert order(found.model) == list(true)
        assert found.added == added
        assert found.chi2 < 1.1 * found.samples
        assert (found is begin) == (added == true)


def test_forces_are_not_tried_in_another_order(monkeypatch):
    model = chained("actuator_lag").with_element(CATALOGUE["cubic_stiffness"], {"coefficient": 100.0})
    series = prepare(records(model, SHORT[2:]), 4)
    begin = trial_of(model, ("actuator_lag", "cubic_stiffness"), series, 1)
    monkeypatch.setattr("rhythmid.diagnose.search.order.run_trials", None)
    assert in_best_order(replace(begin), series, NOISE, 1e-3) == begin
