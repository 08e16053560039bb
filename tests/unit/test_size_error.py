"""Errors of the sizes of effects, relative to the sizes."""

import math

import numpy as np
import pytest

from rhythmid.diagnose.size_error import size_errors, std_beside_others
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


RNG = np.random.default_rng(3)
SPRING, DRAG, SHAPE = RNG.standard_normal((3, 400))
ALMOST = 1e-3 * RNG.standard_normal((2, 400))


def errors_of(
    names: list[str], columns: list[np.ndarray], labels: list[str]
) -> tuple[dict[str, float], dict[str, float]]:
    """Standard deviations of parameters with these sensitivities, of all together and of effects beside the others."""
    jacobian = np.stack(columns, axis=1)
    std = dict(zip(names, np.sqrt(np.diag(np.linalg.inv(jacobian.T @ jacobian))).tolist()))
    return std, std_beside_others(labels, std, jacobian, [None] * len(names))


def test_sizes_that_only_have_a_common_scale_open_are_known_beside_one_another():
    # all forces may be scaled together, as those of a free decay with a second mode
    names = ["linear_spring.stiffness", "quadratic_drag.coefficient", "second_mode.mass"]
    scale = -SPRING - DRAG + ALMOST[0]
    together, beside = errors_of(names, [SPRING, DRAG, scale], ["quadratic_drag", "second_mode"])
    assert beside == pytest.approx({names[1]: 0.05, names[2]: 0.05}, rel=0.1)
    assert min(together[name] / beside[name] for name in names[1:]) > 500.0


def test_a_size_that_the_own_law_leaves_open_stays_open_beside_other_effects():
    names = [
        "linear_spring.stiffness",
        "viscoelastic_relaxation.stiffness",
        "viscoelastic_relaxation.time_constant",
        "quadratic_drag.coefficient",
    ]
    columns = [SPRING, SHAPE, -SHAPE + ALMOST[0], DRAG]
    together, beside = errors_of(names, columns, ["viscoelastic_relaxation", "quadratic_drag"])
    assert beside == pytest.approx({name: together[name] for name in names[1:]}, rel=0.1)
    assert beside[names[1]] > 10.0


def test_what_has_widened_an_interval_remains_beside_other_effects():
    names = ["quadratic_drag.coefficient", "second_mode.mass"]
    jacobian = np.stack([DRAG, -DRAG + ALMOST[0]], axis=1)
    wide = std_beside_others(
        ["quadratic_drag", "second_mode"], dict(zip(names, (300.0, math.inf))), jacobian, [None, None]
    )
    narrow = std_beside_others(
        ["quadratic_drag", "second_mode"], dict(zip(names, (100.0, 50.0))), jacobian, [None, None]
    )
    assert wide[names[0]] == pytest.approx(3.0 * narrow[names[0]])
    assert math.isinf(wide[names[1]])


def test_a_parameter_on_which_no_residual_depends_stays_open_beside_other_effects():
    names = ["quadratic_drag.coefficient", "second_mode.mass"]
    jacobian = np.stack([DRAG, 0.0 * DRAG], axis=1)
    found = std_beside_others(["second_mode"], dict(zip(names, (1.0, math.inf))), jacobian, [None, None])
    assert math.isinf(found[names[1]])
