"""Free maps: splines that the simulator runs, as any other element."""

import math

import numpy as np
import pytest
from scipy.interpolate import BSpline

from machines import hopper
from rhythmid.diagnose.free_map import COEFFICIENTS, FREE_MAPS, first_guess
from rhythmid.simulation.simulate import simulate

RNG = np.random.default_rng(0)
VALUES = {f"c{i}": float(c) for i, c in enumerate(RNG.standard_normal(COEFFICIENTS))}


def drawn(name: str, z: float, low: float = -1.0, high: float = 2.0) -> float:
    """The map of a force, or the change that a map of a signal makes, at one value of its quantity."""
    element = FREE_MAPS[name]
    assert element.kernel is not None
    coefficients = list(VALUES.values())
    if element.slot == "force":
        share = element.parameter("share").default
        return float(element.kernel(z, z, 0.0, 0.0, low, high, share, *coefficients))
    return float(element.kernel(z, 0.0, low, high, *coefficients)) - z


@pytest.mark.parametrize("name", FREE_MAPS)
def test_a_map_is_the_uniform_cubic_spline_of_its_coefficients(name):
    step = 3.0 / (COEFFICIENTS - 3)
    knots = -1.0 + step * np.arange(-3, COEFFICIENTS + 1)
    spline = BSpline(knots, np.array(list(VALUES.values())), 3)
    for z in np.linspace(-1.0, 1.999, 50):
        assert drawn(name, float(z)) == pytest.approx(float(spline(z)), abs=1e-9)


@pytest.mark.parametrize("name", FREE_MAPS)
def test_beyond_its_ends_a_map_stays_as_it_is_there(name):
    assert drawn(name, -50.0) == pytest.approx(drawn(name, -1.0), abs=1e-9)
    assert drawn(name, 50.0) == pytest.approx(drawn(name, 2.0), abs=1e-9)


def test_a_force_takes_the_quantity_that_its_name_says():
    values = (-1.0, 2.0), list(VALUES.values())
    for name, other in (("position", (0.3, 5.0)), ("velocity", (5.0, 0.3))):
        element = FREE_MAPS[f"{name}"]
        share = element.parameter("share").default
        assert element.kernel is not None
        found = element.kernel(*other, 0.0, 0.0, *values[0], share, *values[1])
        assert found == pytest.approx(drawn(name, 0.3))


def test_a_first_guess_covers_the_values_and_is_zero_everywhere():
    values = RNG.uniform(0.1, 0.3, 200)
    guess = first_guess(values)
    assert guess["low"] < values.min() and guess["high"] > values.max()
    assert all(guess[f"c{i}"] == 0.0 for i in range(COEFFICIENTS))


@pytest.mark.parametrize("value", [0.0, 0.2, -1e6])
def test_a_map_of_what_never_changes_has_a_width_all_the_same(value):
    still = first_guess(np.full(10, value))
    assert still["low"] < value < still["high"]


def test_a_map_with_equal_coefficients_pushes_as_a_constant_force_does():
    times = 1e-3 * np.arange(400)
    guess = first_guess(np.array([0.0, 0.4])) | {f"c{i}": 0.7 for i in range(COEFFICIENTS)}
    mapped = hopper().with_element(FREE_MAPS["position"], guess)
    weight = hopper().parameters["gravity.acceleration"].value
    pushed = hopper().with_values({"gravity.acceleration": weight - 0.7})
    one, other = (simulate(model, times, None, None, (0.15, 0.0), 1e-3, None) for model in (mapped, pushed))
    np.testing.assert_allclose(one.position, other.position, atol=1e-9)


def test_maps_are_no_candidates_of_the_search():
    assert not any(element.candidate for element in FREE_MAPS.values())


@pytest.mark.parametrize("name", FREE_MAPS)
def test_of_a_run_that_has_diverged_a_map_makes_no_number(name):
    assert math.isnan(drawn(name, math.nan))
