"""Contenders: the models that the search has fitted in free run, as hypotheses with their predictions.

All are scored on the same rows of whitened residuals. Rows that the fit saw are predicted by cross-validation. Rows that
it did not see are the hidden ends of the same records, or separate records.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from rhythmid.deadline import SPENT, time_is_up
from rhythmid.diagnose.evidence import (
    Blocks,
    CrossValidated,
    Linearised,
    Whole,
    cross_validate,
    prediction,
    time_of_best,
)
from rhythmid.diagnose.hypothesis import Hypothesis, Kind
from rhythmid.diagnose.search.refit import whole_fit
from rhythmid.diagnose.search.trial import Trial
from rhythmid.diagnose.shape import shape_of
from rhythmid.elements.element import Scales
from rhythmid.errors import InputError
from rhythmid.identify.noise import NoiseModel
from rhythmid.identify.output_error import Fit, rerun
from rhythmid.identify.series import Series, record_of
from rhythmid.identify.start_cost import felt_starts, start_freedom
from rhythmid.parallel import fork_map
from rhythmid.progress import Tell, counted, silent

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Rows:
    """The rows on which all hypotheses of a case are scored.

    Parameters
    ----------
    seen : stretches of each series that the fit sees, in order.
    hidden : stretches of each series that are hidden from the fit.
    unseen : separate series that no fit sees.
    noise : noise model by which residuals are whitened.
    record : (n,) record of each row: the seen rows first, then the hidden ones, then those of separate series.
    spread : (n,) relative standard deviation of the noise of each row, see `Series`.
    blocks : blocks of the rows.
    size : rms over all rows of the signal that errors are a share of.
    heldout_size : the same over the rows that no fit sees; 0 where there are none.
    """

    seen: tuple[tuple[slice, ...], ...]
    hidden: tuple[tuple[slice, ...], ...]
    unseen: tuple[Series, ...]
    noise: NoiseModel
    record: Whole
    spread: Array
    blocks: Blocks
    size: float
    heldout_size: float = 0.0

    @property
    def fitted(self) -> int:
        """Number of rows that a fit sees."""
        return int(self.blocks.seen_rows.sum())

    @property
    def held(self) -> tuple[tuple[slice, ...], ...]:
        """Stretches of each separate series."""
        return tuple(one.stretches(self.noise) for one in self.unseen)

    @property
    def heldout(self) -> NDArray[np.bool_]:
        """Rows (n,) that no fit sees."""
        return ~self.blocks.seen_rows


def rows_of(series: Sequence[Series], unseen: Sequence[Series], noise: NoiseModel) -> Rows:
    """The rows of the fitted and of separate held-out series under a noise model."""
    seen = tuple(one.stretches(noise) for one in series)
    hidden = tuple(one.stretches(noise, hidden=True) for one in series)
    others = tuple(one.stretches(noise) for one in unseen)
    names = list(dict.fromkeys(record_of(one) for one in series))
    other_names = list(dict.fromkeys(record_of(one) for one in unseen))
    lengths: list[tuple[int, int]] = []
    spread: list[Array] = []
    power, total, held_power, held_total = 0.0, 0, 0.0, 0
    for parts, group, first in (
        (seen, series, 0),
        (hidden, series, len(names)),
        (others, unseen, 2 * len(names)),
    ):
        listed = other_names if group is unseen else names
        for slices, one in zip(parts, group):
            count = sum(s.stop - s.start for s in slices)
            lengths.append((first + listed.index(record_of(one)), count))
            mask = np.zeros(one.blocks, bool)
            for part in slices:
                mask[part] = True
                spread.append(one.spread_of(part))
            power, total = power + one.power(mask), total + count
            if group is unseen or parts is hidden:
                held_power, held_total = held_power + one.power(mask), held_total + count
    record = np.concatenate([np.full(count, number, dtype=np.int64) for number, count in lengths])
    held = np.arange(len(names), 2 * len(names) + len(other_names))
    rounding = max(one.resolution for one in (*series, *unseen))
    return Rows(
        seen,
        hidden,
        tuple(unseen),
        noise,
        record,
        np.concatenate(spread),
        Blocks.of(record, noise.order, held, rounding / math.sqrt(12.0) / noise.std),
        float(np.sqrt(power / max(total, 1))),
        float(np.sqrt(held_power / max(held_total, 1))),
    )


def linearised(fit: Fit, rows: Rows) -> Linearised:
    """Residual and sensitivities of a fit on all rows.

    Only rows that the fit saw have sensitivities. A parameter at a bound counts as fixed there.
    """
    unseen = [_of_unseen(fit, rows)] if rows.unseen else []
    hidden = [
        one.whitened(rows.noise, residual, parts)
        for one, residual, parts in zip(fit.run.series, fit.residuals, rows.hidden)
    ]
    residual = np.concatenate([fit.linearisation.residual, *hidden, *unseen])
    jacobian = np.zeros((len(residual), len(fit.names)))
    jacobian[: len(fit.linearisation.residual)] = fit.linearisation.jacobian
    jacobian[:, _at_bound(fit)] = 0.0
    priors = [fit.model.parameters[name].prior for name in fit.names]
    return Linearised(
        residual,
        jacobian,
        np.array([0.0 if one is None else one.std**-2 for one in priors]),
        np.array([0.0 if one is None else v - one.mean for one, v in zip(priors, fit.values)]),
    )


def _at_bound(fit: Fit) -> NDArray[np.bool_]:
    """Parameters (p,) that end at a bound; they would stay there if a part of the rows were left out."""
    bounds = [fit.model.parameters[name].bounds for name in fit.names]
    return np.array([not low < value < high for value, (low, high) in zip(fit.values, bounds)], dtype=bool)


def _of_unseen(fit: Fit, rows: Rows) -> Array:
    """Residual on separate held-out records, with only their initial states estimated.

    For a model that diverges there, and so predicts nothing, the motion itself.
    """
    again = rerun(fit.model, rows.unseen, rows.noise, fit.run.max_step)
    if again is not None:
        return again.linearisation.residual
    motions = [one.averaged - one.averaged.mean() for one in rows.unseen]
    cases = zip(rows.unseen, motions, rows.held)
    return np.concatenate([one.whitened(rows.noise, motion, parts) for one, motion, parts in cases])


@dataclass(frozen=True)
class Contender:
    """A fitted model with its prediction errors, whitened and in the measurement's unit, and its free parameters."""

    trial: Trial
    kind: Kind
    found: CrossValidated
    error: Array
    values: Mapping[str, float]


def measured_errors(error: Array, rows: Rows) -> Array:
    """Convert whitened errors (n,) to errors (n,) in the measurement's unit, stretch by stretch."""
    made, first = [], 0
    lengths = [s.stop - s.start for parts in (*rows.seen, *rows.hidden) for s in parts]
    lengths.append(len(error) - sum(lengths))
    for length in lengths:
        made.append(rows.noise.colour(error[first : first + length]))
        first += length
    return rows.spread * np.concatenate(made)


def contend(
    trials: Sequence[tuple[Trial, Kind]],
    series: Sequence[Series],
    rows: Rows,
    step: float,
    reach: float = math.inf,
    tell: Tell = silent,
) -> list[Contender]:
    """Contenders of these trials, in their order.

    Trials that diverge are left out; after the deadline, so are all that are not needed. A trial whose chi2 would not come
    to `reach` is weighed without being fitted to convergence. Two kinds are needed and always fitted completely: the
    nominal model, with which all are compared, and the best model of each number of effects, because richer models are judged
    by what they explain beyond it.
    """
    whole = {min(group, key=lambda one: one.chi2).added for group in _by_size(trials).values()}

    def one(case: tuple[Trial, Kind]) -> tuple[CrossValidated, Array, dict[str, float]]:
        trial, kind = case
        needed = kind == "nominal" or trial.added in whole
        if time_is_up() and not needed:
            raise InputError(SPENT)
        fit = whole_fit(trial, series, rows.noise, step, reach=math.inf if needed else reach)
        if kind == "freed_value":
            check_determined(fit, trial.added[-1])
        found = cross_validate(linearised(fit, rows), rows.blocks)
        state_steps = fit.linearisation.state_steps
        free = start_freedom(
            felt_starts(fit.model, fit.run, rows.noise, fit.starts, fit.residuals, state_steps)
        )
        if free > 0.0:  # distributed over the rows that the fit saw
            found = replace(found, penalty=free / max(rows.fitted, 1))
        values = dict(zip(fit.names, fit.values.tolist(), strict=True))
        return found, measured_errors(found.error, rows), values

    results = counted(fork_map(one, list(trials)), len(trials), "hypotheses", tell)
    done = {i: r for i, r in results if not isinstance(r, Exception) and np.isfinite(r[0].error).all()}
    return [Contender(*trials[i], *done[i]) for i in sorted(done)]


def check_determined(fit: Fit, name: str) -> None:
    """Raise InputError where the records do not determine a freed value.

    The gain of such a fit is due to other parameters, which may then change without limit together with it.
    """
    value, std = fit.model.value(name), fit.std.get(name, math.inf)
    if not std < abs(value):
        raise InputError(f"the records do not determine {name} beside the other parameters")


def _by_size(trials: Sequence[tuple[Trial, Kind]]) -> dict[int, list[Trial]]:
    """The models of kind "effects", grouped by their number of effects."""
    found: dict[int, list[Trial]] = {}
    for trial, kind in trials:
        if kind == "effects":
            found.setdefault(len(trial.added), []).append(trial)
    return found


def hypotheses_of(contenders: Sequence[Contender], rows: Rows, sizes: Scales) -> list[Hypothesis]:
    """Convert the contenders to hypotheses, using the autocorrelation time of the one that predicts best; `sizes` are the records'."""
    time = remembered(contenders, rows)
    return [
        Hypothesis.of(
            one.trial.model,
            one.trial.added,
            one.kind,
            one.trial.free,
            prediction(one.found, rows.blocks, time, one.error),
            heldout_error(one.error, rows),
            shape_of(one.trial.model, one.trial.added, sizes) if one.kind == "effects" else {},
            one.values,
        )
        for one in contenders
    ]


def remembered(contenders: Sequence[Contender], rows: Rows) -> float:
    """Autocorrelation time [rows] of the errors of the contender that predicts best."""
    return time_of_best([one.found for one in contenders], rows.record)


def heldout_error(error: Array, rows: Rows) -> float | None:
    """Relative rms of the errors (n,) on held-out rows; None where nothing is held out."""
    held = rows.heldout
    if not held.any() or rows.heldout_size == 0.0:
        return None
    return float(np.sqrt(np.mean(error[held] ** 2))) / rows.heldout_size
