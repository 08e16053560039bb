"""An effect on a signal that does as well in another place, where the catalogue has nothing like it, is no name."""

from dataclasses import replace

import numpy as np
import pytest

from machines import CATALOGUE, SHORT, hopper, records, search_of
from rhythmid.diagnose import elsewhere as module
from rhythmid.diagnose.elsewhere import elsewhere
from rhythmid.diagnose.search.forward import Search
from rhythmid.diagnose.search.refit import Trial
from rhythmid.identify.noise import NoiseModel
from rhythmid.identify.output_error import estimate
from rhythmid.identify.series import prepare

NOISE = NoiseModel(np.empty(0), 0.5e-4)  # of averages of four samples
LAG, DRIFT = {"time_constant": 0.03}, {"rate": 2e-3}


def search_for(true: str, named: str, values: dict[str, float] | None = None) -> Search:
    """A search that named one effect in records of a machine with another."""
    values = LAG if values is None else values
    machine = hopper().with_element(CATALOGUE[true], values)
    series = prepare(records(machine, SHORT, delays=(0.0203, 0.0151)), 4)
    begin = hopper().with_element(CATALOGUE[named], values)
    fit = estimate(begin, series, noise=NOISE, max_step=1e-3)
    return search_of(fit, named)


@pytest.mark.parametrize(
    ("true", "named", "place"),
    [
        ("sensor_lag", "actuator_lag", "between the mass and the measurement"),
        ("actuator_lag", "sensor_lag", "in the actuator"),
        ("command_lag", "actuator_lag", "in the command path"),
    ],
)
def test_a_lag_that_the_catalogue_lacks_is_told_from_the_one_that_stands_in_for_it(true, named, place):
    others = {"command_lag", "actuator_lag", "sensor_lag"} - {named}
    said = elsewhere(search_for(true, named), CATALOGUE.without(*others))
    assert len(said) == 1 and named.replace("_", " ") in said[0] and place in said[0]


@pytest.mark.parametrize(
    ("true", "named", "place"),
    [
        ("delay_drift", "input_delay_drift", "in the measurement's time"),
        ("input_delay_drift", "delay_drift", "in the command path"),
    ],
)
def test_a_drift_of_a_delay_that_the_catalogue_lacks_is_told_from_the_one_that_stands_in_for_it(
    true, named, place
):
    others = {"delay_drift", "input_delay_drift", "clock_skew"} - {named}
    said = elsewhere(search_for(true, named, DRIFT), CATALOGUE.without(*others))
    assert len(said) == 1 and named.replace("_", " ") in said[0] and place in said[0]


def test_a_drift_that_is_where_it_is_named_stays_its_name():
    found = search_for("input_delay_drift", "input_delay_drift", DRIFT)
    assert elsewhere(found, CATALOGUE.without("delay_drift", "clock_skew")) == []


def test_what_may_only_have_made_up_for_the_wrong_place_is_tried_without_as_well(monkeypatch):
    alone = search_for("command_lag", "actuator_lag")
    mode = {"mass": 0.001, "frequency": 1.5, "damping_ratio": 0.01}
    model = alone.fit.model.with_element(CATALOGUE["second_mode"], mode)
    best = replace(alone.best, added=("actuator_lag", "second_mode"), model=model)
    tried: list[tuple[str, ...]] = []

    def run_trials(proposals, *_):
        tried.extend(one.added for one in proposals)
        return [], []

    monkeypatch.setattr(module, "run_trials", run_trials)
    elsewhere(replace(alone, best=best), CATALOGUE.without("command_lag"))
    moved = "actuator_lag_of_the_command"
    assert tried == [("second_mode", moved), (moved,)]


def test_a_lag_that_is_where_it_is_named_stays_its_name():
    assert (
        elsewhere(search_for("actuator_lag", "actuator_lag"), CATALOGUE.without("command_lag", "sensor_lag"))
        == []
    )


def test_places_for_which_the_catalogue_has_a_lag_have_been_searched():
    assert elsewhere(search_for("sensor_lag", "actuator_lag"), CATALOGUE) == []


def test_what_has_a_size_in_the_unit_of_its_signal_is_not_moved():
    machine = hopper().with_element(CATALOGUE["actuator_saturation"], {"limit": 0.8})
    series = prepare(records(machine, SHORT[:1]), 4)
    fit = estimate(machine, series, noise=NOISE, max_step=1e-3)
    trial = Trial(
        ("actuator_saturation",), fit.model, fit.starts, fit.chi2, fit.samples, len(fit.names), True, fit.noise,
        fit.differences,
    )  # fmt: skip
    assert elsewhere(Search(fit, trial, fit, fit.noise, (trial,), (), ()), CATALOGUE) == []
