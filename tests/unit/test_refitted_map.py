"""A free map refitted beside the nominal model predicts what an unknown law of the same quantity does."""

import numpy as np
import pytest

from machines import CATALOGUE, SHORT, hopper, records
from rhythmid.diagnose.contenders import linearised, rows_of
from rhythmid.diagnose.location import dependences, refitted_map
from rhythmid.diagnose.search.score_tests import trajectories
from rhythmid.diagnose.search.trial import Trial
from rhythmid.identify.noise import NoiseModel
from rhythmid.identify.output_error import Fit, estimate
from rhythmid.identify.series import hold_out_tail, prepare

NOISE = NoiseModel(np.empty(0), 0.5e-4)
STEP = 1e-3


def nominal_of(fit: Fit) -> Trial:
    return Trial(
        (), fit.model, fit.starts, fit.chi2, fit.samples, len(fit.names), True, NOISE, fit.differences
    )


@pytest.mark.parametrize(
    ("name", "values", "quantity"),
    [
        ("quadratic_drag", {"coefficient": 3.0}, "velocity"),
        ("cubic_stiffness", {"coefficient": 2e4}, "position"),
    ],
)
def test_the_map_of_the_quantity_in_question_predicts_better_refitted_than_to_first_order(
    name, values, quantity
):
    machine = hopper().with_element(CATALOGUE[name], values)
    series = hold_out_tail(prepare(records(machine, SHORT), 4))[0]
    fit = estimate(hopper(), series, noise=NOISE, max_step=STEP)
    rows, known = rows_of(series, [], NOISE), trajectories(fit)
    before = dependences(known, rows)
    found = refitted_map(nominal_of(fit), before, known, series, rows, STEP)
    assert found is not None and found[0] == quantity
    first_order = next(one for one in before if one.quantity == quantity).found.error
    plain = linearised(fit, rows).residual
    left = [np.mean(error[rows.heldout] ** 2) for error in (found[1].found.error, first_order, plain)]
    assert left[0] < 0.5 * left[1] and left[0] < 0.1 * left[2]


def test_without_a_dependence_there_is_no_map():
    series = hold_out_tail(prepare(records(hopper(), SHORT), 4))[0]
    fit = estimate(hopper(), series, noise=NOISE, max_step=STEP)
    assert (
        refitted_map(nominal_of(fit), [], trajectories(fit), series, rows_of(series, [], NOISE), STEP) is None
    )
