"""A value that the nominal model holds fixed, and that the records contradict, is told where nothing else explains them."""

from dataclasses import replace

import numpy as np
import pytest

from machines import CATALOGUE, SHORT, hopper, records, search_of
from rhythmid.diagnose.given_value import wrong_value
from rhythmid.diagnose.search.forward import Search
from rhythmid.identify.noise import NoiseModel
from rhythmid.identify.output_error import estimate
from rhythmid.identify.series import prepare
from rhythmid.model import INERTIA, Model

NOISE = NoiseModel(np.empty(0), 0.5e-4)  # of averages of four samples


def search_with(truth: Model, given_mass: float, named: str = "actuator_fade", **values: float) -> Search:
    """A search that found only a fading actuator, in records of a machine whose mass was held at a value."""
    series = prepare(records(truth, SHORT), 4)
    mass = replace(hopper().mass, value=given_mass, fixed=True)
    begin = hopper().with_parameters({INERTIA: mass})
    begin = begin.with_element(CATALOGUE[named], values or {"rate": 1e-3})
    fit = estimate(begin, series, noise=NOISE, max_step=1e-3)
    return search_of(fit, named)


def test_a_fast_mode_that_makes_up_for_a_mass_given_too_light_is_seen_through():
    true = hopper().mass.value
    mode = {"mass": 0.05 * true, "frequency": 60.0, "damping_ratio": 0.05}
    said = wrong_value(search_with(hopper(), 0.95 * true, "second_mode", **mode))
    assert said is not None and said.startswith("inertia.mass is held at")


def test_a_mass_that_is_held_at_a_wrong_value_is_told_with_the_right_one():
    true = hopper().mass.value
    said = wrong_value(search_with(hopper(), 0.93 * true))
    assert said is not None and said.startswith(f"inertia.mass is held at {0.93 * true:g} kg")
    assert float(said.partition("comes out at ")[2].partition(",")[0]) == pytest.approx(true, rel=0.01)


def test_a_mass_that_is_held_at_its_right_value_is_not_blamed():
    fades = hopper().with_element(CATALOGUE["actuator_fade"], {"rate": 5e-3})
    assert wrong_value(search_with(fades, hopper().mass.value)) is None
