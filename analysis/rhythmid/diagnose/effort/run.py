"""Diagnosis by the recorded effort: the search, the evaluation on data that no fit has seen, and the decision."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from rhythmid.deadline import deadline
from rhythmid.diagnose.case import SEARCHED, Case
from rhythmid.diagnose.constants import PRACTICAL_EFFORT, UNNAMED_EFFORT
from rhythmid.diagnose.discrepancy import mean_product
from rhythmid.diagnose.effort.candidate import columns_of, screen, starts_of
from rhythmid.diagnose.effort.fitted import Fitted, odds_at_rest
from rhythmid.diagnose.effort.reference import (
    HISTORY,
    Mapped,
    beyond_noise,
    history_of,
    map_columns,
    reference_of,
    residual_with_map,
)
from rhythmid.diagnose.effort.remainder import Curve, remainder_of
from rhythmid.diagnose.effort.scales import scales_at
from rhythmid.diagnose.effort.search import GAP, MOST_EFFECTS, EffortSearch, search_effort
from rhythmid.diagnose.evidence import (
    Blocks,
    CrossValidated,
    Linearised,
    cross_validate,
    detectable,
    prediction,
    time_of_best,
    with_trusted_rests,
)
from rhythmid.diagnose.hypothesis import Hypothesis, Prediction
from rhythmid.diagnose.model_uncertainty import covariance_between
from rhythmid.diagnose.selection import Contest, Selection, select
from rhythmid.diagnose.size_error import size_errors
from rhythmid.diagnose.verdict import Decision, decide
from rhythmid.elements.catalogue import Catalogue
from rhythmid.errors import InputError
from rhythmid.identify.inverse_dynamics.applicability import Applicability
from rhythmid.identify.inverse_dynamics.balance import Balance
from rhythmid.identify.inverse_dynamics.estimate import size_of, variation_of
from rhythmid.identify.inverse_dynamics.free_map import FreeMap
from rhythmid.identify.inverse_dynamics.motion_noise import noise_power
from rhythmid.identify.robust_covariance import root_weights, weighted, with_robust_std

Array = NDArray[np.float64]
K = TypeVar("K")
PAST = 8  # past errors that predict a lasting one: two periods of the filter's cut-off, at 2.5 rows a period and more
LEAST_ROWS = 4 * PAST  # minimum rows of a record


@dataclass(frozen=True, eq=False)
class EffortResult:
    """All data behind an answer from effort scoring.

    `size_errors` are the relative standard deviations of the chosen effects' sizes, by label. `errors` are the rms
    prediction errors, by the key of a hypothesis.
    """

    applicability: Applicability
    search: EffortSearch
    heldout: Balance | None
    contest: Contest
    selection: Selection
    decision: Decision
    detectable: float
    size_errors: Mapping[str, float]
    chosen: Fitted
    nominal: Fitted
    remainder: tuple[Curve, ...]
    errors: dict[tuple[str, ...], float]


@dataclass(frozen=True, eq=False)
class _Rows:
    """The rows that all hypotheses predict: those that their fits saw, then those of held-out records."""

    record: NDArray[np.int64]
    blocks: Blocks
    heldout: Balance | None

    def predicted(self, fitted: Fitted, mapped: Mapped | None = None) -> CrossValidated:
        """Prediction errors of a fit, or of the same fit with a free map beside its parameters."""
        seen = fitted.linearised if mapped is None else mapped.linearised
        if self.heldout is None:
            return cross_validate(seen, self.blocks)
        if mapped is None:
            fit = fitted.fit
            other = self.heldout.predicted(fit.model, fit.alignment) - self.heldout.measured
            rests = odds_at_rest(fit, self.heldout)
        else:
            other = residual_with_map(self.heldout, fitted, mapped)
            rests = np.full(len(self.heldout.rests.found), np.nan)
        residual = np.concatenate([seen.residual, other])
        jacobian = np.vstack([seen.jacobian, np.zeros((len(other), seen.jacobian.shape[1]))])
        rests = np.concatenate([seen.rests, rests])
        return cross_validate(
            Linearised(residual, jacobian, seen.precision, seen.departure, rests), self.blocks
        )

    def rms(self, found: CrossValidated) -> float:
        """Rms error on held-out records; without any, on all rows, each predicted by the fit that did not see it."""
        seen = self.blocks.seen_rows
        return float(np.sqrt(np.mean(found.error[seen if seen.all() else ~seen] ** 2)))


def _rows(case: Case, found: EffortSearch, heldout: Balance | None) -> _Rows:
    if case.holdout:
        try:
            heldout = Balance.of(case.holdout, found.nominal.fit.model, found.balance.bandwidth)
        except InputError:
            heldout = None  # too little motion, or no effort: they cannot be used for judging
    record = found.balance.record
    if heldout is None:
        return _Rows(record, Blocks.of(record, GAP), None)
    first = int(record.max()) + 1
    others = heldout.record + first
    whole = np.concatenate([record, others])
    return _Rows(whole, Blocks.of(whole, GAP, np.unique(others)), heldout)


def effort_run(
    case: Case,
    applicability: Applicability,
    most: int = MOST_EFFECTS,
    unseen: Balance | None = None,
    promising: float | None = None,
    places: int = 1,
) -> EffortResult:
    """Search for up to `most` effects, weigh the hypotheses and decide.

    Parameters
    ----------
    case, applicability : the case, and whether and how effort scoring applies.
    most : largest number of effects.
    unseen : balance of held-out efforts, where the case has no held-out records.
    promising : as for `search_effort`.
    places : number of joints at which the same search is made; the number of candidates is multiplied by it.

    Raises InputError where the records hold too little motion.
    """
    with deadline(case.budget.at(SEARCHED)):
        found = search_effort(
            case.records, case.nominal, case.catalogue, applicability.balance, most, case.tell, case.budget,
            promising,
        )  # fmt: skip
    case.tell("weighing the hypotheses on data that no fit has seen")
    rows, size = _rows(case, found, unseen), variation_of(found.balance)
    predicted = {one.elements: rows.predicted(one) for one in found.hypotheses}
    ruled_out = {one.elements: rows.predicted(one) for one in found.ruled_out}
    left = remainder_of(found.balance, found.chosen)
    mapped = _with_maps(found, rows, left, history=places == 1)
    time = time_of_best([*predicted.values(), *mapped.values()], rows.record)
    weighed = _weighed(ruled_out, rows.blocks, time) | _weighed(predicted, rows.blocks, time)
    errors = {tuple(sorted(key)): rows.rms(one) for key, one in (ruled_out | predicted).items()}
    maps = _weighed(mapped, rows.blocks, time)
    if case.records:  # for the joint of a body only the balance is given
        noise = noise_power(found.balance, case.records, found.chosen.fit.model)
        maps = {of: beyond_noise(one, weighed[found.chosen.elements], noise) for of, one in maps.items()}

    def claimed(one: Fitted) -> Hypothesis:
        return one.claimed(weighed[one.elements], errors[one.key] / size)

    contest = Contest(
        tuple(claimed(one) for one in found.hypotheses),
        maps,
        places * found.candidates,
        size,
        PRACTICAL_EFFORT,
        UNNAMED_EFFORT,
        tuple(claimed(one) for one in found.ruled_out),
        cut_short=found.cut_short,
    )
    selection = select(contest)
    chosen = next(one for one in found.hypotheses if one.key == selection.chosen.key)
    if places == 1:  # with several joints the error of one may be caused by another
        lasting = lasting_share(predicted[chosen.elements].error, rows.record, GAP)
        contest = replace(contest, structured_after=lasting)
    least = detectable(predicted[chosen.elements].error, time) / size
    robust = replace(chosen, fit=with_robust_std(chosen.fit, found.balance.record))
    errors_of_sizes = size_errors(chosen.fit.model, chosen.elements, robust.std_beside_others())
    return EffortResult(
        applicability,
        found,
        rows.heldout,
        contest,
        selection,
        decide(contest, selection, least, errors_of_sizes),
        least,
        errors_of_sizes,
        _among_models(robust, case.catalogue, found.balance, contest, selection),
        found.nominal,
        left if chosen is found.chosen else remainder_of(found.balance, chosen),
        errors,
    )


def _with_maps(
    found: EffortSearch, rows: _Rows, left: Sequence[Curve], history: bool
) -> dict[str, CrossValidated]:
    """Prediction errors of the chosen model with free maps, by the quantity that they depend on.

    With several joints the effort depends on more than the `history` of the joint's own motion.
    """
    of_the_motion = next(curve.quantity for curve in left if curve.joint is None)
    maps = {of_the_motion: found.beyond}
    if history:
        maps[HISTORY] = history_of(found.balance, found.chosen, found.blocks)
    if (beside := left[0].joint) is not None:
        maps[left[0].quantity] = reference_of(found.balance, found.chosen, found.blocks, beside)
    return {quantity: rows.predicted(found.chosen, one) for quantity, one in maps.items()}


def _weighed(found: Mapping[K, CrossValidated], blocks: Blocks, time: float) -> dict[K, Prediction]:
    each = with_trusted_rests([prediction(one, blocks, time) for one in found.values()], blocks)
    return dict(zip(found, each, strict=True))


def _among_models(
    chosen: Fitted, catalogue: Catalogue, balance: Balance, contest: Contest, selection: Selection
) -> Fitted:
    """The chosen fit with robust standard deviations, extended by the choice of the model and by small missing effects."""
    between = covariance_between(chosen.fit.names, selection.chosen, contest.hypotheses)
    fit = chosen.fit
    std = fit.std.copy()  # the alignment comes first and belongs to no model
    std[1:] = np.hypot(std[1:], np.sqrt(np.diag(between)))
    return replace(chosen, fit=replace(fit, std=np.hypot(std, small_effects(balance, chosen, catalogue))))


def small_effects(balance: Balance, chosen: Fitted, catalogue: Catalogue) -> Array:
    """Standard deviations (p,) of the fit's parameters due to small effects that it lacks.

    The effects are those of the catalogue and any function of the motion.
    """
    fit = chosen.fit
    sizes = scales_at(balance, fit)
    starts = [one for one in starts_of(catalogue, fit.model, sizes, balance) if one.kind == "effects"]
    changes = columns_of(balance, fit, [one.start for one in screen(balance, fit, starts)])
    rows = weighted(fit, fit.correlation)
    free = map_columns(balance, chosen, FreeMap(list(balance.motions), size_of(balance)))
    root = root_weights(fit, fit.correlation)
    changes = np.hstack([changes, free]) * root[:, None]
    signal = float(np.linalg.norm((balance.measured - balance.measured.mean()) * root))
    errors = mean_product(rows.columns, rows.residual, changes, rows.inverse, signal)
    std = np.zeros(len(fit.std))
    std[rows.inside] = np.sqrt(np.diag(errors))
    return std


def lasting_share(error: Array, record: NDArray[np.int64], memory: int) -> float:
    """Share of an error's rms that is predicted by errors `memory` rows and more before it; 0 where nothing is.

    Filtered noise is correlated over the length of the filter, and no further. An error that follows from earlier ones is not
    noise: it shows that the model lacks something. The prediction is linear. Each half of every record is predicted with the coefficients of the other halves, so that a
    chance correlation predicts nothing.

    Parameters
    ----------
    error : (n,) predicted less recorded, at neighbouring rows.
    record : (n,) record of each row, in order.
    memory : rows over which the filter mixes neighbours.
    """
    past, now, fold = [], [], []
    for number in np.unique(record):
        one = error[record == number]
        if len(one) < LEAST_ROWS + memory:
            continue
        windows = np.lib.stride_tricks.sliding_window_view(one[:-memory], PAST)
        later = one[PAST + memory - 1 :]
        past.append(windows)
        now.append(later)
        fold.append(2 * np.arange(len(later)) // len(later))
    if not now:
        return 0.0
    x, y, of = np.vstack(past), np.concatenate(now), np.concatenate(fold)
    left = 0.0
    for out in (of == 0, of == 1):
        coefficients = np.linalg.lstsq(x[~out], y[~out], rcond=None)[0]
        left += float(np.sum((y[out] - x[out] @ coefficients) ** 2))
    whole = float(y @ y)
    return math.sqrt(max(1.0 - left / whole, 0.0)) if whole > 0.0 else 0.0
