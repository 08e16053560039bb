"""Evidence: how well each hypothesis predicts data that its fit has not seen, and the resulting probabilities.

Blocks of the records are left out in turn. The parameters that the other blocks give are computed from the one fit of all
blocks by Gauss-Newton steps (approximate cross-validation: K. R. Rad, A. Maleki, J. R. Stat. Soc. B 82 (2020) 965;
R. Giordano et al., AISTATS 2019). For a hypothesis that is linear in its parameters this is exact. Predictive densities are
Student's t, with a scale that varies about that of the blocks which the fit saw (`varying_scale`). They are divided by the
residual's integrated autocorrelation time, so that correlated samples do not count twice. Hypotheses are compared by their
differences in each block. The standard error of the sum shows how much of it depends on the choice of records. Pseudo-BMA
weights under the Bayesian bootstrap (Y. Yao, A. Vehtari, D. Simpson, A. Gelman, Bayesian Analysis 13 (2018) 917) turn the
differences into probabilities.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray
from scipy.special import expit

from rhythmid.diagnose.constants import (
    BLOCK_ODDS,
    BLOCKS,
    BLOCKS_OF_A_RECORD,
    DRAWS,
    EFFECT_PRIOR,
    EQUIVALENT,
    FALSE_ALARM,
    FOLDS,
    REWEIGHTED,
    ROWS_OF_A_BLOCK,
    SHOWS,
)
from rhythmid.diagnose.hypothesis import Hypothesis, Prediction
from rhythmid.diagnose.varying_scale import block_densities
from rhythmid.identify.least_squares import column_norms
from rhythmid.identify.student import autocorrelation_time, log_density, scale_of, weights_of

Array = NDArray[np.float64]
Whole = NDArray[np.int64]
UNSEEN = -1  # fold of blocks that no fit sees
PART = 50_000  # rows of a sum that are weighted at once


@dataclass(frozen=True)
class Linearised:
    """A fit in the form that cross-validation needs.

    Parameters
    ----------
    residual : (n,) predicted less measured, in one unit for all hypotheses of a case.
    jacobian : (n, p) its derivatives with respect to the parameters.
    precision : (p,) inverse variance of each parameter's prior; 0 where it has none.
    departure : (p,) each parameter's value less its prior's mean.
    rests : (r,) log odds of each rest of the machine, at most 0; see `odds_of_rests`. Not numbers where they are unknown.
    """

    residual: Array
    jacobian: Array
    precision: Array
    departure: Array
    rests: Array = field(default_factory=lambda: np.zeros(0))


@dataclass(frozen=True)
class Blocks:
    """Contiguous blocks of rows, and the fold of each.

    Parameters
    ----------
    block : (n,) block of each row.
    fold : (b,) fold of each block; `UNSEEN` for blocks that no fit sees.
    gap : rows on either side of a left-out block that its fit does not see either.
    least : lower limit of the error scale, such as that of rounding. At rest, rounded samples and a model may agree to the
        last digit, which does not show how well the model predicts.
    """

    block: Whole
    fold: Whole
    gap: int = 0
    least: float = 0.0

    @classmethod
    def of(cls, record: Whole, gap: int = 0, unseen: Whole | None = None, least: float = 0.0) -> "Blocks":
        """Blocks of rows that belong to the records `record` (n,), numbered from 0 in order.

        The number of blocks of a record is proportional to its length. Blocks of the records in `unseen` are in no fold.
        """
        total = max(len(record), 1)
        block = np.zeros(len(record), dtype=np.int64)
        hidden: list[bool] = []
        first = 0
        for number in range(int(record.max(initial=-1)) + 1):
            rows = np.flatnonzero(record == number)
            if not len(rows):
                continue
            most = min(BLOCKS, total // ROWS_OF_A_BLOCK)
            count = max(BLOCKS_OF_A_RECORD, round(most * len(rows) / total))
            count = min(count, len(rows))
            block[rows] = first + (np.arange(len(rows)) * count) // len(rows)
            first += count
            hidden += [unseen is not None and number in unseen] * count
        fold = np.full(first, UNSEEN, dtype=np.int64)
        seen = ~np.array(hidden, dtype=bool)
        fold[seen] = np.arange(int(seen.sum())) % FOLDS
        return cls(block, fold, gap, least)

    @property
    def count(self) -> int:
        """Number of blocks."""
        return len(self.fold)

    @property
    def seen_rows(self) -> NDArray[np.bool_]:
        """Rows (n,) that a fit sees."""
        return self.fold[self.block] != UNSEEN

    def sums(self, values: Array) -> Array:
        """Sums (b,) of values (n,) over the blocks."""
        return np.asarray(np.bincount(self.block, values, self.count), dtype=np.float64)

    def split(self, values: Array) -> list[Array]:
        """Values (n,) split into blocks, b arrays."""
        ends = np.cumsum(np.bincount(self.block, minlength=self.count))
        return np.split(values[np.argsort(self.block, kind="stable")], ends[:-1])

    def left_out(self, fold: int) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
        """Rows (n,) that a fold leaves out, and rows (n,) that its fit sees: the others without gaps and unseen blocks."""
        out = self.fold[self.block] == fold
        near = out.copy()
        for shift in range(1, self.gap + 1):
            near[shift:] |= out[:-shift]
            near[:-shift] |= out[shift:]
        seen = ~near & self.seen_rows
        return out, seen if seen.any() else ~out & self.seen_rows


@dataclass(frozen=True)
class CrossValidated:
    """Prediction errors (n,), each of a fit that did not see the row, and the scale (b,) that the fit expected in each block.

    `penalty` is subtracted from the log density of every row that a fit sees. It is the cost of free initial states, which
    cross-validation does not include. `rests` (r,) are log odds of rests, which no fit sees.
    """

    error: Array
    scale: Array
    penalty: float = 0.0
    rests: Array = field(default_factory=lambda: np.zeros(0))


def cross_validate(fit: Linearised, blocks: Blocks) -> CrossValidated:
    """Predict every block from the others.

    The fit of the other blocks has the fit of all blocks as a prior, with the information of one average row (unit
    information: R. E. Kass, L. Wasserman, J. Am. Stat. Assoc. 90 (1995) 928). Without this prior, noise would move the
    parameters far along a direction that only the left-out block determines, beyond the range of the linearisation.
    """
    residual, jacobian = fit.residual, fit.jacobian
    error, scale = residual.copy(), np.ones(blocks.count)
    norms = column_norms(jacobian)
    precision, pull = np.diag(fit.precision / norms**2), fit.precision * fit.departure / norms
    precision = precision + _unit_information(residual, jacobian, blocks) / np.outer(norms, norms)
    for fold in np.unique(blocks.fold):
        out, seen = blocks.left_out(int(fold))
        change = np.zeros(len(residual))
        spread = max(scale_of(residual[seen]), blocks.least)
        for _ in range(REWEIGHTED if jacobian.shape[1] else 0):
            weight = np.where(seen, weights_of(residual + change, spread) / spread**2, 0.0)
            normal, right = _normal_equations(jacobian, weight, residual)
            normal = normal / np.outer(norms, norms) + precision
            step = np.linalg.lstsq(normal, right / norms + pull, rcond=1e-12)[0] / norms
            # avoids a negated copy of the jacobian, which is large for long records
            change = jacobian @ -step
            spread = max(scale_of((residual + change)[seen]), blocks.least)
        error[out] += change[out]
        scale[blocks.fold == fold] = spread
    return CrossValidated(error, scale, rests=fit.rests)


def _unit_information(residual: Array, jacobian: Array, blocks: Blocks) -> Array:
    """Average information (p, p) on the parameters of one row that the folds see."""
    seen = blocks.seen_rows
    spread = max(scale_of(residual[seen]), blocks.least)
    weight = np.where(seen, weights_of(residual, spread) / spread**2, 0.0)
    return _normal_equations(jacobian, weight, residual)[0] / max(int(seen.sum()), 1)


def _normal_equations(jacobian: Array, weight: Array, residual: Array) -> tuple[Array, Array]:
    """JᵀWJ (p, p) and JᵀWr (p,), summed in parts: a weighted copy of all rows of long records would be large."""
    normal, right = np.zeros((jacobian.shape[1],) * 2), np.zeros(jacobian.shape[1])
    for first in range(0, len(jacobian), PART):
        part = slice(first, first + PART)
        weighted = jacobian[part] * weight[part, None]
        normal += weighted.T @ jacobian[part]
        right += weighted.T @ residual[part]
    return normal, right


def prediction(
    found: CrossValidated, blocks: Blocks, time: float, measured: Array | None = None
) -> Prediction:
    """The blocks' log densities and squared errors. Each rest is one more block, without samples.

    `time` is the autocorrelation time [samples], the same for all hypotheses. `measured` (n,) are the errors in the unit of
    the measurement, where the scored ones are whitened.
    """
    seen = blocks.fold != UNSEEN
    counts = blocks.sums(np.ones(len(found.error)))
    density = block_densities(blocks.split(found.error), found.scale, time, seen, blocks.least)
    error = found.error if measured is None else measured
    none = np.zeros(len(found.rests))
    return Prediction(
        np.concatenate([density - found.penalty * counts * seen / time, found.rests]),
        np.concatenate([blocks.sums(error**2), none]),
        np.concatenate([counts, none]),
        np.concatenate([~seen, none.astype(bool)]),
    )


def odds_of_rests(excess: Sequence[Array], scale: float) -> Array:
    """Log odds (r,) of rests against one that the model balances, by efforts (n,) that it does not balance; at most 0.

    `scale` is that of the model's errors. A rest counts as one sample, because effort and position hardly change in it. Its odds are limited
    to `BLOCK_ODDS`: a brake or a hand that no model contains may hold the machine. A rest that the model balances says nothing for it.
    """
    lost = [float(np.mean(log_density(one, scale) - log_density(np.zeros(1), scale))) for one in excess]
    return np.maximum(np.array(lost), -math.log(BLOCK_ODDS))


def predict(fits: Sequence[Linearised], blocks: Blocks, record: Whole) -> list[Prediction]:
    """Predictions of several hypotheses on the same rows, which belong to the records `record` (n,).

    The autocorrelation time is that of the hypothesis that predicts best, because the errors of the others are not noise.
    """
    found = [cross_validate(fit, blocks) for fit in fits]
    if not found:
        return []
    time = time_of_best(found, record)
    return with_trusted_rests([prediction(one, blocks, time) for one in found], blocks)


def with_trusted_rests(predictions: Sequence[Prediction], blocks: Blocks) -> list[Prediction]:
    """Predictions in which rests count where they can be trusted, and otherwise say nothing.

    All rests of a machine may have one cause that no model contains, such as a brake. They are trusted as long as a hypothesis that balances
    them predicts the motion as well as any: the motion decides, and rests decide where it does not. For a free map, whose rests are
    not numbers, they say nothing.
    """
    motion = np.array([one.log_density[: blocks.count] for one in predictions])
    rests = np.array([one.log_density[blocks.count :].sum() for one in predictions])
    known = np.flatnonzero(~np.isnan(rests))
    trusted = False
    if len(known) and rests[known].min() < 0.0:
        score = motion[known].sum(axis=1)
        balances = rests[known] >= rests[known].max() - EFFECT_PRIOR
        best, other = known[np.argmax(score)], known[np.argmax(np.where(balances, score, -math.inf))]
        gain, error = _summed(motion[best] - motion[other])
        trusted = gain <= max(EQUIVALENT * error, -math.log(FALSE_ALARM))
    return [
        replace(
            one, log_density=np.concatenate([own, np.nan_to_num(one.log_density[blocks.count :]) * trusted])
        )
        for one, own in zip(predictions, motion, strict=True)
    ]


def time_of_best(found: Sequence[CrossValidated], record: Whole) -> float:
    """Autocorrelation time [rows] of the errors of the best prediction."""
    best = min(found, key=lambda one: float(np.sum(one.error**2)))
    return autocorrelation_time(best.error, record)


def difference(first: Prediction, second: Prediction) -> tuple[float, float]:
    """Log density by which the first predicts better than the second, and its standard error."""
    return _summed(first.log_density - second.log_density)


def removed(first: Prediction, second: Prediction) -> tuple[float, float]:
    """Reduction of the mean squared error from the second to the first, and its standard error."""
    total, error = _summed(second.squared_error - first.squared_error)
    samples = max(float(second.samples.sum()), 1.0)
    return total / samples, error / samples


def weight_for(first: Prediction, second: Prediction) -> float:
    """Logarithm of the odds that the data give the first against the second, limited to `BLOCK_ODDS` for each block.

    If the second is true, the expected odds of a block are at most one. By chance the odds therefore exceed 1/a in at most a
    share a of cases (Markov's inequality; V. Vovk, R. Wang, Ann. Stat. 49 (2021) 1736). Evidence against the first counts
    without limit: an effect that helps in one block and harms in another gains no weight.
    """
    return float(np.minimum(first.log_density - second.log_density, math.log(BLOCK_ODDS)).sum())


def chance_better(first: Prediction, second: Prediction, least: float) -> float:
    """Chance that the first predicts better than the second by more than the log density `least`.

    Computed by the Bayesian bootstrap of the blocks.
    """
    gain = first.log_density - second.log_density
    found = len(gain) * _resampled(len(gain)) @ gain - least
    return float(np.mean(expit(found)))


def detectable(error: Array, time: float) -> float:
    """The smallest detectable rms among errors (n,) of this autocorrelation time, in their unit.

    It adds `SHOWS` standard deviations to the errors' mean square.
    """
    return math.sqrt(SHOWS * float(np.mean(error**2)) * math.sqrt(2.0 * time / max(len(error), 1)))


def gain_ahead(first: Prediction, second: Prediction) -> float:
    """Standard errors by which the first predicts unseen blocks better than the second; infinite where nothing is held out.

    A spectral line that is only the ringing of a resonance, or a spurious drift, predicts blocks between others that its
    fit saw. It does not predict the blocks after them.
    """
    if first.unseen is None or not first.unseen.any():
        return math.inf
    gain, error = _summed((first.log_density - second.log_density)[first.unseen])
    return gain / error if 0.0 < error < math.inf else math.inf


def _summed(gain: Array) -> tuple[float, float]:
    """Sum of the blocks' differences, and its standard error."""
    count = len(gain)
    error = math.sqrt(count) * float(np.std(gain, ddof=1)) if count > 1 else math.inf
    return float(gain.sum()), error


def _resampled(count: int) -> Array:
    """Weights (draws, count) of the Bayesian bootstrap of `count` blocks; each draw sums to one."""
    return np.random.default_rng(0).dirichlet(np.ones(count), DRAWS)


def probabilities(hypotheses: Sequence[Hypothesis]) -> Array:
    """Probability (h,) of each of these hypotheses: pseudo-BMA weights under the Bayesian bootstrap of the blocks."""
    if not hypotheses:
        return np.zeros(0)
    densities = np.array([one.prediction.log_density for one in hypotheses])
    prior = -EFFECT_PRIOR * np.array([len(one.elements) for one in hypotheses], dtype=float)
    count = densities.shape[1]
    scores = count * _resampled(count) @ densities.T + prior
    scores -= scores.max(axis=1, keepdims=True)
    each = np.exp(scores)
    return np.asarray((each / each.sum(axis=1, keepdims=True)).mean(axis=0), dtype=np.float64)
