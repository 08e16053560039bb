"""Errors of the sizes of effects, relative to the sizes."""

import math

import pytest

from rhythmid.diagnose.size_error import size_errors
from rhythmid.elements.catalogue import load_catalogue
from rhythmid.identify.identify import paper_hopper
from rhythmid.model import Model

KNOWN = load_catalogue()


def with_effect(name: str, **values: float) -> tuple[Model, str]:
    grown = paper_hopper().with_element(KNOWN[name], values)
    return grown, grown.terms[-1].label


def test_an_error_is_relative_to_the_departure_from_where_the_effect_is_absent():
    model, label = with_effect("coulomb_friction", force=2.0, transition=0.01)
    assert size_errors(model, [label], {f"{label}.force": 0.5}) == pytest.approx({label: 0.25})


def test_a_limit_has_the_relative_error_of_its_inverse():
    model, label = with_effect("actuator_saturation", limit=4.0)
    assert size_errors(model, [label], {f"{label}.limit": 1.0}) == pytest.approx({label: 0.25})


@pytest.mark.parametrize("force, std", [(0.0, 0.1), (2.0, math.nan), (2.0, math.inf)])
def test_a_size_of_nothing_or_without_a_standard_deviation_is_not_determined(force, std):
    model, label = with_effect("coulomb_friction", force=force, transition=0.01)
    assert size_errors(model, [label], {f"{label}.force": std}) == {label: math.inf}


def test_a_stop_may_be_too_stiff_for_records_to_say_how_stiff():
    model, label = with_effect("end_stop_contact", stiffness=1e4, damping_ratio=0.1, position=0.1, side=1.0)
    assert size_errors(model, [label], {f"{label}.stiffness": 1e6}) == {}


def test_what_is_no_effect_or_was_not_estimated_is_left_out():
    model, label = with_effect("coulomb_friction", force=2.0, transition=0.01)
    assert size_errors(model, [label, "inertia.mass", "input_delay.delay"], {}) == {}
