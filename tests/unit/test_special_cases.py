"""An element that another one contains exerts the same force as the other at the stated values of its parameters."""

import inspect

import numpy as np
import pytest

from rhythmid.elements.catalogue import load_catalogue

CATALOGUE = load_catalogue()
BORROWED = {"mass": 1.0, "step": 1e-6, "load": 0.7}
FAR = 1e6  # as far outside the travel as rounding allows
LIMITS = [
    ("constant_force", {"force": 0.3}, "linear_spring", {"stiffness": 0.3 / FAR, "rest_length": FAR}),
    (
        "coulomb_friction", {"force": 0.3, "transition": 0.01},
        "asymmetric_coulomb_friction", {"force": 0.3, "asymmetry": 0.0, "transition": 0.01},
    ),
    (
        "coulomb_friction", {"force": 0.3, "transition": 0.01},
        "stribeck_friction", {"force": 0.3, "static_ratio": 1.0, "stribeck_speed": 0.1, "transition": 0.01},
    ),
    (
        "load_dependent_friction", {"coefficient": 0.2, "transition": 0.01},
        "transmitted_load_friction", {"coefficient": 0.2, "external_ratio": 0.0, "transition": 0.01},
    ),
    (
        "bilinear_stiffness", {"change": 20.0, "kink": 0.1},
        "end_stop_contact", {"stiffness": 20.0, "damping_ratio": 0.0, "position": 0.1, "side": 1.0},
    ),
]  # fmt: skip


def force(name: str, values: dict[str, float], x: float, v: float, f: float) -> float:
    """The force of an element at a position, a velocity and an acting force."""
    kernel = CATALOGUE[name].kernel
    assert kernel is not None
    given = {"x": x, "v": v, "t": 0.0, "f": f} | BORROWED | values
    return float(kernel(**{name: given[name] for name in inspect.signature(kernel).parameters}))


@pytest.mark.parametrize(("name", "values", "richer", "limit"), LIMITS)
def test_a_special_case_exerts_the_force_of_the_law_that_contains_it(name, values, richer, limit):
    assert richer in CATALOGUE[name].special_case_of
    rng = np.random.default_rng(1)
    for x, v, f in rng.normal(size=(200, 3)):
        assert force(richer, limit, x, v, f) == pytest.approx(force(name, values, x, v, f), abs=1e-5)
