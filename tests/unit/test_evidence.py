"""Evidence: what is predicted of data that a fit has not seen, against refits that leave them out, and the probabilities."""

import math
from dataclasses import replace

import numpy as np
import pytest
from contests import predicted, supposed
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import minimize
from scipy.signal import lfilter
from scipy.stats import t as student

from rhythmid.diagnose import evidence
from rhythmid.diagnose.constants import BLOCKS_OF_A_RECORD, FOLDS
from rhythmid.diagnose.evidence import (
    UNSEEN,
    Blocks,
    Linearised,
    cross_validate,
    detectable,
    difference,
    gain_ahead,
    predict,
    prediction,
    probabilities,
    weight_for,
)
from rhythmid.identify.student import DEGREES, autocorrelation_time, log_density, scale_of, weights_of

LENGTHS = st.lists(st.integers(1, 900), min_size=1, max_size=5)
SEEDS = st.integers(0, 2**31)
FEW = settings(max_examples=30, deadline=None)


def without_priors(residual: np.ndarray, jacobian: np.ndarray) -> Linearised:
    """A fit whose parameters have no priors."""
    none = np.zeros(jacobian.shape[1])
    return Linearised(residual, jacobian, none, none)


def rows_of(lengths: list[int]) -> np.ndarray:
    """The record of each row of records of these lengths."""
    return np.repeat(np.arange(len(lengths)), lengths)


def line(rows: int, columns: int, seed: int = 0) -> tuple[np.ndarray, np.ndarray]:
    """A regression: measurements (n,) of a sum of columns (n, p) with noise of Student's t."""
    rng = np.random.default_rng(seed)
    design = rng.standard_normal((rows, columns))
    noise = student.rvs(DEGREES, size=rows, random_state=rng)
    return design @ rng.standard_normal(columns) + noise, design


def least_squares(measured: np.ndarray, design: np.ndarray) -> Linearised:
    """The regression as a fit, at its least-squares solution."""
    solution = np.linalg.lstsq(design, measured, rcond=None)[0]
    return without_priors(design @ solution - measured, design)


# blocks


@FEW
@given(LENGTHS, st.integers(0, 3))
def test_blocks_partition_the_rows_contiguously_and_none_spans_two_records(lengths, gap):
    record = rows_of(lengths)
    blocks = Blocks.of(record, gap)
    assert (np.diff(blocks.block) >= 0).all()
    assert np.array_equal(np.unique(blocks.block), np.arange(blocks.count))
    assert len(np.unique(np.column_stack([blocks.block, record]), axis=0)) == blocks.count


@FEW
@given(LENGTHS)
def test_every_record_has_its_blocks_and_all_folds_leave_out_alike(lengths):
    record = rows_of(lengths)
    blocks = Blocks.of(record)
    for number, length in enumerate(lengths):
        assert len(np.unique(blocks.block[record == number])) >= min(BLOCKS_OF_A_RECORD, length)
    counts = np.bincount(blocks.fold, minlength=FOLDS)
    assert counts.max() - counts.min() <= 1


@FEW
@given(LENGTHS, SEEDS)
def test_sums_over_blocks_add_up(lengths, seed):
    values = np.random.default_rng(seed).standard_normal(sum(lengths))
    assert Blocks.of(rows_of(lengths)).sums(values).sum() == pytest.approx(values.sum(), abs=1e-9)


@FEW
@given(st.lists(st.integers(60, 600), min_size=1, max_size=4), st.integers(0, 5))
def test_every_row_is_left_out_once_and_neither_it_nor_its_neighbours_are_seen_then(lengths, gap):
    blocks = Blocks.of(rows_of(lengths), gap)
    times = np.zeros(sum(lengths), dtype=int)
    for fold in np.unique(blocks.fold):
        out, seen = blocks.left_out(int(fold))
        times += out
        assert not (out & seen).any()
        assert np.abs(np.flatnonzero(out)[:, None] - np.flatnonzero(seen)).min() > gap
    assert (times == 1).all()


def test_held_out_records_are_seen_by_no_fold_and_predicted_by_all():
    record = rows_of([400, 400])
    blocks = Blocks.of(record, 2, np.array([1]))
    assert set(blocks.fold[np.unique(blocks.block[record == 1])]) == {UNSEEN}
    for fold in np.unique(blocks.fold):
        assert not blocks.left_out(int(fold))[1][record == 1].any()
    assert np.array_equal(blocks.left_out(UNSEEN)[0], record == 1)


# densities


def test_the_density_is_students_and_its_weights_are_those_of_its_maximum():
    error = np.linspace(-5.0, 5.0, 101)
    np.testing.assert_allclose(log_density(error, 0.7), student.logpdf(error, DEGREES, scale=0.7), rtol=1e-12)
    slope = np.gradient(log_density(error, 0.7), error, edge_order=2)
    np.testing.assert_allclose(slope, -weights_of(error, 0.7) * error / 0.7**2, atol=0.03)


@FEW
@given(SEEDS, st.floats(1e-6, 1e6))
def test_the_scale_is_the_most_likely_one_in_any_unit(seed, unit):
    error = unit * student.rvs(DEGREES, size=400, random_state=np.random.default_rng(seed))
    best = minimize(
        lambda s: -log_density(error, unit * math.exp(s[0])).sum(), [0.0], method="Nelder-Mead"
    ).x[0]
    assert scale_of(error) == pytest.approx(unit * math.exp(best), rel=5e-3)


def test_an_outlier_moves_the_scale_and_the_fit_but_little():
    measured, design = line(600, 3)
    plain = cross_validate(least_squares(measured, design), Blocks.of(rows_of([600])))
    wild = measured.copy()
    wild[300] += 1e4
    found = cross_validate(least_squares(wild, design), Blocks.of(rows_of([600])))
    others = np.arange(600) != 300
    assert np.abs(found.error - plain.error)[others].max() < 0.1
    assert found.scale.max() < 1.1 * plain.scale.max()


def test_errors_that_are_all_zero_have_a_scale_whose_square_is_a_number():
    assert 0.0 < scale_of(np.zeros(50)) ** 2 < 1e-200


@pytest.mark.parametrize("rest", [0.0, 1e-200, 1e-12])
def test_errors_most_of_which_are_none_have_the_scale_of_the_others_or_less(rest):
    error = np.random.default_rng(3).standard_t(4, 1000)
    error[:600] = rest
    assert 0.0 < scale_of(error) < 1.0


def resting(error_at_rest, least):
    """Log density of errors of unit scale with one block at rest, where the model errs by this."""
    error = np.random.default_rng(5).standard_t(4, 600)
    error[200:250] = error_at_rest
    none = Linearised(error, np.zeros((600, 0)), np.zeros(0), np.zeros(0))
    return predict([none], Blocks.of(rows_of([600]), least=least), rows_of([600]))[0].score


def test_where_rounded_samples_rest_a_model_that_is_right_to_the_last_digit_is_no_better_than_one_within_the_rounding():
    assert np.isfinite(resting(0.0, 0.3))
    assert resting(0.0, 0.3) == pytest.approx(resting(0.2, 0.3), abs=15.0)
    assert resting(0.0, 0.0) > resting(0.2, 0.0) + 30.0  # where nothing is rounded the difference counts


# cross-validation


@FEW
@given(SEEDS, st.integers(1, 5))
def test_what_a_linear_model_predicts_is_what_refits_without_each_block_predict(seed, columns):
    measured, design = line(240, columns, seed)
    blocks = Blocks.of(rows_of([120, 120]), 1)
    whole = least_squares(measured, design)
    found = cross_validate(whole, blocks)
    fitted = np.linalg.lstsq(design, measured, rcond=None)[0]
    spread = scale_of(whole.residual)
    root = np.sqrt(weights_of(whole.residual, spread) / len(measured)) / spread
    one_row = np.linalg.qr(
        design * root[:, None], mode="r"
    )  # what one row says of the parameters, on average
    for fold in np.unique(blocks.fold):
        out, seen = blocks.left_out(int(fold))
        values, scale = fitted, scale_of(whole.residual[seen])
        for _ in range(evidence.REWEIGHTED):
            root = np.sqrt(weights_of(design[seen] @ values - measured[seen], scale)) / scale
            rows, right = design[seen] * root[:, None], measured[seen] * root
            rows, right = np.vstack([rows, one_row]), np.concatenate([right, one_row @ fitted])
            values = np.linalg.lstsq(rows, right, rcond=None)[0]
            scale = scale_of(design[seen] @ values - measured[seen])
        np.testing.assert_allclose(found.error[out], design[out] @ values - measured[out], atol=1e-8)
        np.testing.assert_allclose(found.scale[blocks.block][out], scale, rtol=1e-8)


def test_reweighted_refits_come_to_the_most_likely_fit():
    measured, design = line(600, 2)
    blocks = Blocks.of(rows_of([600]))
    found = cross_validate(least_squares(measured, design), blocks)
    out, seen = blocks.left_out(0)

    def cost(values):
        return -log_density(design[seen] @ values[:2] - measured[seen], math.exp(values[2])).sum()

    best = minimize(cost, np.zeros(3), method="BFGS").x
    error = design[out] @ best[:2] - measured[out]
    assert np.abs(found.error[out] - error).max() < 0.02 * np.abs(error).max()


@FEW
@given(SEEDS)
def test_where_the_fit_stands_does_not_matter_to_what_a_linear_model_predicts(seed):
    measured, design = line(240, 3, seed)
    blocks = Blocks.of(rows_of([240]))
    fit = least_squares(measured, design)
    away = replace(fit, residual=fit.residual + design @ np.array([0.02, -0.03, 0.01]))
    np.testing.assert_allclose(
        cross_validate(fit, blocks).error, cross_validate(away, blocks).error, atol=0.01
    )


def test_a_column_of_noise_predicts_worse_than_none_and_the_true_one_better():
    measured, design = line(1200, 1)
    record, blocks = rows_of([1200]), Blocks.of(rows_of([1200]))
    idle = np.random.default_rng(9).standard_normal((1200, 12))
    without, true, wide = predict(
        [
            without_priors(-measured, np.empty((1200, 0))),
            least_squares(measured, design),
            least_squares(measured, np.hstack([design, idle])),
        ],
        blocks,
        record,
    )
    assert true.score > wide.score
    assert true.score > without.score and true.mean_square < without.mean_square


def test_a_prior_holds_what_a_fold_does_not_determine_and_units_do_not_matter():
    measured, design = line(300, 2)
    blocks = Blocks.of(rows_of([300]))
    fit = least_squares(measured, design)
    solution = np.linalg.lstsq(design, measured, rcond=None)[0]
    # a prior that is sure of a value far away pulls the prediction there
    held = replace(fit, precision=np.array([1e12, 0.0]), departure=np.array([0.5, 0.0]))
    moved = cross_validate(held, blocks)
    alone = least_squares(measured - design[:, 0] * (solution[0] - 0.5), design[:, 1:])
    np.testing.assert_allclose(moved.error, cross_validate(alone, blocks).error, atol=1e-2)
    unit = np.array([1e-6, 1e5])
    scaled = Linearised(held.residual, design / unit, held.precision / unit**2, held.departure * unit)
    np.testing.assert_allclose(cross_validate(scaled, blocks).error, moved.error, atol=1e-7)


def test_rows_that_no_fit_sees_are_predicted_by_the_fit_of_all_others():
    measured, design = line(500, 2)
    blocks = Blocks.of(rows_of([400, 100]), 0, np.array([1]))
    found = cross_validate(least_squares(measured, design), blocks)
    wild = measured.copy()
    wild[400:] += 1e3
    again = cross_validate(
        without_priors(least_squares(measured, design).residual - (wild - measured), design),
        blocks,
    )
    np.testing.assert_allclose(again.error[:400], found.error[:400], atol=1e-9)
    np.testing.assert_allclose(again.error[400:], found.error[400:] - 1e3, atol=1e-9)


def test_a_penalty_is_taken_off_the_rows_that_a_fit_sees_only():
    measured, design = line(400, 1)
    blocks = Blocks.of(rows_of([300, 100]), 0, np.array([1]))
    found = cross_validate(least_squares(measured, design), blocks)
    plain = prediction(found, blocks, 2.0)
    costly = prediction(replace(found, penalty=0.5), blocks, 2.0)
    assert plain.score - costly.score == pytest.approx(0.5 * 300 / 2.0)
    assert plain.mean_square == costly.mean_square


# autocorrelation


@pytest.mark.parametrize("correlation", [0.0, 0.5, 0.9])
def test_the_autocorrelation_time_is_that_of_an_autoregressive_process(correlation):
    noise = np.random.default_rng(2).standard_normal((2, 20000))
    error = np.concatenate(lfilter([1.0], [1.0, -correlation], noise))
    true = (1.0 + correlation) / (1.0 - correlation)
    assert autocorrelation_time(error, rows_of([20000, 20000])) == pytest.approx(true, rel=0.15)


@FEW
@given(SEEDS, st.integers(1, 40))
def test_the_autocorrelation_time_is_at_least_a_sample(seed, count):
    error = np.random.default_rng(seed).standard_normal(count)
    assert autocorrelation_time(error, rows_of([count])) >= 1.0
    assert autocorrelation_time(np.zeros(count), rows_of([count])) == 1.0


def test_samples_that_repeat_one_another_do_not_count_twice():
    measured, design = line(2000, 1)
    once = predict([least_squares(measured, design)], Blocks.of(rows_of([2000])), rows_of([2000]))[0]
    many = np.repeat(measured, 5), np.repeat(design, 5, axis=0)
    five = predict([least_squares(*many)], Blocks.of(rows_of([10000])), rows_of([10000]))[0]
    assert five.score == pytest.approx(once.score, rel=0.1)


# comparison


def test_a_difference_and_its_standard_error_are_those_of_the_blocks():
    rng = np.random.default_rng(0)
    first, second = (replace(predicted(1.0), log_density=rng.standard_normal(60)) for _ in range(2))
    gain, error = difference(first, second)
    assert gain == pytest.approx(first.score - second.score)
    assert error == pytest.approx(math.sqrt(60) * (first.log_density - second.log_density).std(ddof=1))
    assert difference(second, first) == (pytest.approx(-gain), pytest.approx(error))


@pytest.mark.parametrize("effect", [0.1, 0.5, 2.0])
def test_odds_against_a_true_hypothesis_are_as_rare_as_they_are_large(effect):
    # log likelihood ratios of a mean that is `effect` against one that is zero, which is true
    rng, often = np.random.default_rng(5), 0
    for _ in range(400):
        gain = effect * rng.standard_normal(60) - 0.5 * effect**2
        first = replace(predicted(1.0), log_density=gain)
        often += weight_for(first, replace(first, log_density=np.zeros(60))) > math.log(20.0)
    assert often <= 0.05 * 400


def test_no_block_counts_for_more_than_strong_evidence_but_harm_counts_in_full():
    none = replace(predicted(1.0), log_density=np.zeros(3))
    mixed = replace(none, log_density=np.array([50.0, 1.0, -30.0]))
    assert weight_for(mixed, none) == pytest.approx(math.log(20.0) + 1.0 - 30.0)


def test_what_goes_on_where_no_fit_has_looked_is_told_in_standard_errors():
    unseen = np.arange(60) >= 48
    none = replace(predicted(1.0), log_density=np.zeros(60), unseen=unseen)
    density = np.where(unseen, np.resize([-1.0, -3.0], 60), 5.0)
    ahead = gain_ahead(replace(none, log_density=density), none)
    assert ahead == pytest.approx(-24.0 / (math.sqrt(12) * np.std(density[unseen], ddof=1)))
    assert gain_ahead(replace(none, unseen=None), none) == math.inf


def test_one_block_alone_tells_no_standard_error():
    one = replace(predicted(1.0), log_density=np.array([1.0]))
    assert difference(one, one) == (0.0, math.inf)


@FEW
@given(st.lists(st.floats(-1e4, 1e4), min_size=1, max_size=8), SEEDS)
def test_probabilities_are_positive_and_sum_to_one(scores, seed):
    rivals = [
        supposed(f"e{i}", predicted(1.0, score, seed=seed % 1000 + i)) for i, score in enumerate(scores)
    ]
    found = probabilities(rivals)
    assert found.sum() == pytest.approx(1.0) and (found >= 0.0).all()


def test_probabilities_follow_the_scores_and_are_the_same_in_every_run():
    rivals = [supposed(name, predicted(1.0, score)) for name, score in (("a", 0.0), ("b", 2.0), ("c", 40.0))]
    found = probabilities(rivals)
    assert found[2] > 0.9 and found[1] > found[0]
    np.testing.assert_array_equal(found, probabilities(rivals))
    np.testing.assert_allclose(probabilities(rivals[::-1]), found[::-1])


def test_a_further_effect_has_its_price():
    one, two = (supposed(name, predicted(1.0, 10.0, seed=0)) for name in ("a", "a b"))
    found = probabilities([one, two])
    assert found[0] > found[1] > 0.0


def test_a_gain_that_depends_on_few_blocks_leaves_the_names_open():
    steady = predicted(1.0, 0.0, mood=0.0)
    gain = np.zeros(60)
    gain[0] = 6.0
    sure = replace(steady, log_density=np.full(60, 0.1))
    moody = replace(steady, log_density=gain)
    names = [supposed("a", steady), supposed("b", sure)], [supposed("a", steady), supposed("b", moody)]
    assert probabilities(names[0])[1] > 0.99 > probabilities(names[1])[1] > 0.5


def test_nothing_has_no_probabilities():
    assert len(probabilities([])) == 0 and predict([], Blocks.of(rows_of([50])), rows_of([50])) == []


def test_what_adds_four_standard_deviations_to_the_mean_square_of_noise_is_detectable():
    rng = np.random.default_rng(0)
    squares = [np.mean((3.0 * rng.standard_normal(500)) ** 2) for _ in range(4000)]
    noise = 3.0 * rng.standard_normal(500)
    noise *= 3.0 / np.sqrt(np.mean(noise**2))
    assert detectable(noise, 1.0) ** 2 == pytest.approx(4.0 * np.std(squares), rel=0.05)
    assert detectable(noise, 16.0) == pytest.approx(
        2.0 * detectable(noise, 1.0)
    )  # a 16th of the samples counts
