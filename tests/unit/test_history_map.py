"""Unknown physics with a memory: what a free function of the motion and its past predicts, and what it does not pretend to."""

from dataclasses import replace

import numpy as np
from axes import CATALOGUE, axis, axis_model

from rhythmid.diagnose.diagnosis import diagnose
from rhythmid.diagnose.effort.reference import HISTORY, history_of, reference_of, residual_with_map
from rhythmid.diagnose.effort.search import search_effort
from rhythmid.diagnose.evidence import cross_validate
from rhythmid.identify.inverse_dynamics.balance import Balance
from rhythmid.identify.inverse_dynamics.estimate import variation_of
from rhythmid.identify.inverse_dynamics.history_map import stop

NOTHING = CATALOGUE.without(*(name for name, one in CATALOGUE.items() if one.candidate))


def test_a_stop_follows_the_motion_until_it_has_moved_by_its_width_since_the_last_turn():
    position = np.array([0.0, 0.5, 1.5, 3.0, 2.5, 1.0, 1.0])
    np.testing.assert_allclose(stop(position, 1.0), [0.0, 0.5, 1.0, 1.0, 0.5, -1.0, -1.0])


def hysteretic(seed: int = 0, force: float = 1.5):
    """An axis without dry friction whose effort has a hysteresis besides: it yields 4 mm from where the axis has last turned."""
    record = axis(seed, friction=0.0)
    effort = record.input
    more = force * stop(np.interp(effort.time, record.output.time, record.output.value), 0.004)
    return replace(record, input=replace(effort, value=effort.value + more))


def errors(record):
    """Shares of the effort that the nominal model misses of what its fit did not see: alone, with curves, and with a function of the past."""
    found = search_effort([record], axis_model(), NOTHING)
    nominal, blocks = found.nominal, found.blocks
    beside = (one(found.balance, nominal, blocks) for one in (reference_of, history_of))
    fits = [nominal.linearised, *(one.linearised for one in beside)]
    size = variation_of(found.balance)
    return [float(np.sqrt(np.mean(cross_validate(one, blocks).error ** 2))) / size for one in fits]


def test_a_hysteresis_is_predicted_from_the_past_and_from_no_curve():
    alone, curves, past = errors(hysteretic())
    assert past < 0.6 * alone and past < 0.7 * curves


def test_noise_is_not_predicted_from_the_past():
    alone, _, past = errors(axis(friction=0.0))
    assert past > 0.97 * alone


def test_a_function_of_the_past_predicts_records_that_it_has_not_seen():
    found = search_effort([hysteretic()], axis_model(), NOTHING)
    map_ = history_of(found.balance, found.nominal, found.blocks)
    again = residual_with_map(found.balance, found.nominal, map_)
    np.testing.assert_allclose(again, map_.linearised.residual, atol=0.05 * variation_of(found.balance))
    unseen = Balance.of([hysteretic(7)], axis_model(), found.balance.bandwidth)
    fit = found.nominal.fit
    plain = unseen.predicted(fit.model, fit.alignment) - unseen.measured
    mapped = residual_with_map(unseen, found.nominal, map_)
    assert np.sqrt(np.mean(mapped**2)) < 0.8 * np.sqrt(np.mean(plain**2))


def test_a_hysteresis_that_the_catalogue_lacks_is_unknown_physics_of_the_past():
    found = diagnose([hysteretic(), hysteretic(3)], axis_model(), catalogue=NOTHING).diagnosis
    assert found.verdict == "unknown_physics" and found.remainder.goes_with == HISTORY
