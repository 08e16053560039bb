"""Contenders: all hypotheses of a case are scored on the same rows, those that no fit has seen among them."""

import math
from dataclasses import replace

import numpy as np
import pytest

from machines import CATALOGUE, SHORT, hopper, records, search_of
from rhythmid.diagnose.constants import EDGE
from rhythmid.diagnose.contenders import (
    Rows,
    contend,
    heldout_error,
    hypotheses_of,
    linearised,
    measured_errors,
    rows_of,
)
from rhythmid.diagnose.evidence import difference
from rhythmid.identify.noise import NoiseModel
from rhythmid.identify.output_error import Fit, estimate
from rhythmid.identify.record_scales import scales
from rhythmid.identify.series import Series, hold_out_tail, prepare
from rhythmid.model import Model
from rhythmid.value import Prior

NOISE = NoiseModel(np.array([0.3, 0.1]), 0.5e-4)
FRICTION = {"force": 0.05, "transition": 0.002}
RUBBING = hopper().with_element(CATALOGUE["coulomb_friction"], FRICTION)


@pytest.fixture(scope="module")
def given() -> list[Series]:
    """Two records of a hopper with friction, the last fifth of each held out."""
    return hold_out_tail(prepare(records(RUBBING, SHORT[:2]), 4))[0]


@pytest.fixture(scope="module")
def separate() -> list[Series]:
    return prepare(records(RUBBING, SHORT[2:], seed=4), 4)


def fitted(model: Model, series: list[Series]) -> Fit:
    return estimate(model, series, noise=NOISE, max_step=1e-3)


@pytest.fixture(scope="module")
def plain(given) -> Fit:
    return fitted(hopper(), given)


@pytest.fixture(scope="module")
def rubbing(given) -> Fit:
    return fitted(RUBBING, given)


def test_rows_are_all_that_was_measured_once_and_held_out_ones_are_in_no_fold(given, separate):
    rows = rows_of(given, separate, NOISE)
    total = sum(one.blocks for one in (*given, *separate))
    assert len(rows.record) == len(rows.blocks.block) == total
    assert rows.fitted == sum(int(one.used.sum()) for one in given)
    assert rows.heldout.sum() == total - rows.fitted
    assert not rows.heldout[: rows.fitted].any()


def test_every_record_its_held_out_end_and_every_separate_one_has_blocks_of_its_own(given, separate):
    rows = rows_of(given, separate, NOISE)
    assert len(np.unique(rows.record)) == 2 * len(given) + len(separate)
    assert rows.blocks.gap == NOISE.order


def test_the_size_that_errors_are_a_share_of_is_that_of_the_motion(given):
    rows = rows_of(given, [], NOISE)
    assert 0.5 < rows.size / np.std(np.concatenate([one.averaged for one in given])) < 2.0


def test_errors_in_the_unit_of_the_measurement_are_those_whose_whitening_was_scored(given, plain):
    rows = rows_of(given, [], NOISE)
    white = linearised(plain, rows).residual
    error = measured_errors(white, rows)
    seen = np.concatenate([r[part] for r, parts in zip(plain.residuals, rows.seen) for part in parts])
    # but for what is left of the initial state, which is projected out
    np.testing.assert_allclose(error[: rows.fitted], seen, atol=1e-3 * np.abs(seen).max())
    hidden = np.concatenate([r[part] for r, parts in zip(plain.residuals, rows.hidden) for part in parts])
    np.testing.assert_allclose(error[rows.fitted :], hidden, atol=1e-9 * np.abs(hidden).max())


def test_rows_that_a_fit_does_not_see_do_not_move_it(given, separate, plain):
    found = linearised(plain, rows_of(given, separate, NOISE))
    assert (found.jacobian[rows_of(given, [], NOISE).fitted :] == 0.0).all()
    assert np.abs(found.jacobian[: rows_of(given, [], NOISE).fitted]).max() > 0.0


def test_priors_of_parameters_are_part_of_a_fit(given, plain):
    name = plain.names[0]
    value = plain.model.parameters[name]
    prior = replace(value, prior=Prior(value.value - 2.0, 0.5))
    found = linearised(
        replace(plain, model=plain.model.with_parameters({name: prior})), rows_of(given, [], NOISE)
    )
    assert found.precision[0] == 4.0 and found.departure[0] == pytest.approx(
        plain.values[0] - value.value + 2.0
    )
    assert (found.precision[1:] == 0.0).all()


def contest(given: list[Series], rows: Rows, plain: Fit, rubbing: Fit):
    trials = search_of(plain).best, search_of(rubbing, "coulomb_friction").best
    return contend([(trials[0], "nominal"), (trials[1], "effects")], given, rows, 1e-3)


def test_the_true_effect_predicts_what_no_fit_has_seen_and_its_shape_is_looked_at(
    given, separate, plain, rubbing
):
    rows = rows_of(given, separate, NOISE)
    found = contest(given, rows, plain, rubbing)
    nominal, friction = hypotheses_of(found, rows, scales(given, plain.model))
    gain, error = difference(friction.prediction, nominal.prediction)
    assert gain > 10.0 * error > 0.0
    assert friction.elements == friction.names == ("coulomb_friction",) and nominal.kind == "nominal"
    assert friction.shape["within_bounds"] > EDGE and nominal.shape == {}
    assert friction.heldout_nrmse < 0.5 * nominal.heldout_nrmse
    assert len(friction.prediction.log_density) == rows.blocks.count


def test_a_hypothesis_that_fails_is_left_out_and_the_others_keep_their_order(given, plain, rubbing):
    rows = rows_of(given, [], NOISE)
    good = search_of(rubbing, "coulomb_friction").best
    wild = replace(good, model=good.model.with_values({"linear_spring.stiffness": 1e13}))
    with np.errstate(all="ignore"):
        found = contend([(wild, "effects"), (good, "effects")], given, rows, 1e-3)
    assert [one.trial for one in found] == [good]


@pytest.mark.parametrize(("name", "determined"), [("gravity.acceleration", False), ("inertia.mass", True)])
def test_a_value_that_is_set_free_competes_where_the_records_determine_it(given, plain, name, determined):
    # gravity moves the rest of the motion as the free rest length does
    freed = plain.model.with_parameters({name: replace(plain.model.parameters[name], fixed=False)})
    trial = replace(search_of(fitted(freed, given)).best, added=(name,))
    found = contend([(trial, "freed_value")], given, rows_of(given, [], NOISE), 1e-3)
    assert bool(found) is determined


def test_every_felt_start_of_an_effects_own_states_costs_one_of_log_density_at_most(given, plain):
    rows = rows_of(given, [], NOISE)
    lagging = fitted(
        hopper().with_element(CATALOGUE["actuator_lag"], {"time_constant": 0.02}, fixed=True), given
    )
    trials = [(search_of(plain).best, "nominal"), (search_of(lagging, "actuator_lag").best, "effects")]
    stateless, with_states = contend(trials, given, rows, 1e-3)
    assert stateless.found.penalty == 0.0
    assert 0.0 < with_states.found.penalty * rows.fitted <= len(given)


def test_without_held_out_rows_there_is_no_error_on_them(given):
    everything = np.ones(given[0].blocks, dtype=bool)
    whole = [replace(one, used=everything, hidden=~everything) for one in given]
    rows = rows_of(whole, [], NOISE)
    assert heldout_error(np.ones(len(rows.record)), rows) is None
    rows = rows_of(given, [], NOISE)
    assert heldout_error(np.full(len(rows.record), rows.heldout_size), rows) == pytest.approx(1.0)
    assert math.isfinite(rows.size)


def test_a_model_that_diverges_on_held_out_records_predicts_nothing_there_and_stays(given, separate, plain):
    rows = rows_of(given, separate, NOISE)
    wild = replace(plain, model=plain.model.with_values({"linear_spring.stiffness": 1e13}))
    with np.errstate(all="ignore"):
        found = linearised(wild, rows)
    last = sum(one.blocks for one in separate)
    assert np.isfinite(found.residual).all()
    assert np.std(found.residual[-last:]) > 10.0 * np.std(found.residual[: rows.fitted])
