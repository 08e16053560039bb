"""Locate a mismatch without naming it: on which quantity does the missing force (or sensor error) depend?

To first order each free function is another hypothesis: a free map beside the model. Its prediction of left-out blocks shows which
quantity the mismatch depends on, and whether the names leave something that another explanation would predict. The map also
draws laws that the catalogue lacks.
"""

import math
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from rhythmid.diagnose.contenders import Contender, Rows, contend, linearised
from rhythmid.diagnose.evidence import CrossValidated, Linearised, cross_validate
from rhythmid.diagnose.free_functions import SPLINED, FreeFunction, free_functions, values_of
from rhythmid.diagnose.free_map import FREE_MAPS, first_guess
from rhythmid.diagnose.search.refit import run_trials
from rhythmid.diagnose.search.score_tests import Trajectories, trajectories
from rhythmid.diagnose.search.trial import Origin, Trial, propose
from rhythmid.freed_memory import give_back
from rhythmid.identify.free_run import prepare_run
from rhythmid.identify.least_squares import column_norms
from rhythmid.identify.output_error import Fit, rerun
from rhythmid.identify.series import Series

Array = NDArray[np.float64]
RIDGE = 1e-4  # prior precision of a coefficient, relative to its information in all rows


@dataclass(frozen=True)
class Dependence:
    """How much of the residual a free function of `quantity` explains.

    `explained` is the share of the residual's sum of squares above the noise, in blocks left out of the fit (at most 1; below 0
    where the function fits only noise). `grid` (g,) and `force` (g,) draw a function of one quantity, in the model's unit of force,
    or of position for a sensor error. `found` holds the prediction errors.
    """

    quantity: str
    explained: float
    grid: Array
    force: Array
    found: CrossValidated


@dataclass(frozen=True)
class Reach:
    """Sensitivities of whitened rows of one series that its fit does not see.

    Needed to predict a free map together with the parameters, which were fitted without it.

    Parameters
    ----------
    parameters : (h, p) sensitivities of the h hidden rows to the parameters, after refitting the initial state.
    starts : (h, q) sensitivities of the hidden rows to the initial state.
    seen : (n, q) the same of the n rows to which the initial state is fitted: the rows that the fit sees, or for a separate
        held-out record all of its rows, which are also the hidden ones.
    """

    parameters: Array
    starts: Array
    seen: Array

    def refitted(self, seen: Array, hidden: Array) -> Array:
        """Changes of the hidden rows (h, k) after fitting the initial state to the changes of the seen rows (n, k)."""
        norms = column_norms(self.seen)
        taken = np.linalg.lstsq(self.seen / norms, seen, rcond=1e-7)[0]
        return hidden - self.starts / norms @ taken


def _parts(rows: Rows) -> list[tuple[Sequence[slice], Sequence[slice]]]:
    """For each series, then each separate held-out one: the stretches to which its initial state is fitted, and the hidden ones."""
    return [*zip(rows.seen, rows.hidden, strict=True), *((parts, parts) for parts in rows.held)]


def with_held_out(fit: Fit, rows: Rows) -> Fit:
    """The fit extended by its runs over the separate held-out records; unchanged without any, or where it diverges there."""
    beyond = rerun(fit.model, rows.unseen, rows.noise, fit.run.max_step)
    if beyond is None:
        return fit
    return replace(
        fit,
        starts=(*fit.starts, *beyond.starts),
        residuals=(*fit.residuals, *beyond.residuals),
        run=prepare_run(fit.model, (*fit.run.series, *rows.unseen), fit.run.max_step),
    )


def reach_of(fit: Fit, rows: Rows, pool: ThreadPoolExecutor | None = None) -> list[Reach]:
    """Sensitivities of the hidden rows of each series of the fit's run to its parameters and initial states."""
    model, (steps, state_steps) = fit.model, (fit.linearisation.steps, fit.linearisation.state_steps)
    moved = [model.with_values({name: model.value(name) + step}) for name, step in zip(fit.names, steps)]
    cases = [(one, fit.starts) for one in moved]
    cases += [(model, tuple(start + shift for start in fit.starts)) for shift in np.diag(state_steps)]
    here, *outputs = fit.run.many([(model, fit.starts), *cases], pool)
    scale, p = np.concatenate([steps, state_steps]), len(fit.names)
    found = []
    for index, (series, parts) in enumerate(zip(fit.run.series, _parts(rows))):
        change = np.zeros((series.blocks, len(scale)))
        for column, output in enumerate(outputs):
            if output is not None and here is not None:
                change[:, column] = (output[index] - here[index]) / scale[column]
        seen, hidden = (series.whitened(rows.noise, change, which) for which in parts)
        plain = Reach(hidden[:, :p], hidden[:, p:], seen[:, p:])
        found.append(Reach(plain.refitted(seen[:, :p], hidden[:, :p]), plain.starts, plain.seen))
    return found


def following(base: Linearised, rows: Rows, reach: Sequence[Reach]) -> Linearised:
    """The linearised fit with the sensitivities of hidden rows, and of separate held-out rows as far as `reach` has them."""
    jacobian = base.jacobian.copy()
    hidden = np.concatenate([one.parameters for one in reach])
    jacobian[rows.fitted : rows.fitted + len(hidden)] = hidden
    return Linearised(base.residual, jacobian, base.precision, base.departure)


def beside(fit: Fit, base: Linearised, one: FreeFunction, rows: Rows, reach: Sequence[Reach]) -> Linearised:
    """The linearised fit, with its sensitivities of hidden rows, extended to first order by a free map."""
    known, count = base.jacobian.shape[1], len(one.columns)
    jacobian = np.zeros((len(base.residual), known + count))
    jacobian[:, :known] = base.jacobian
    added = jacobian[:, known:]
    bases = fit.linearisation.bases
    first, below = 0, rows.fitted  # position of the next seen rows and of the next hidden ones
    for index, (series, parts) in enumerate(zip(fit.run.series, _parts(rows))):
        columns = np.column_stack([column[index] for column in one.columns])
        white, unseen = (series.whitened(rows.noise, columns, which) for which in parts)
        if index < len(bases):
            added[first : first + len(white)] = white - bases[index] @ (bases[index].T @ white)
            first += len(white)
        added[below : below + len(unseen)] = reach[index].refitted(white, unseen)
        below += len(unseen)
    information = np.einsum("ij,ij->j", added[: rows.fitted], added[: rows.fitted])
    return Linearised(
        base.residual,
        jacobian,
        np.concatenate([base.precision, RIDGE * np.maximum(information, 1e-300)]),
        np.concatenate([base.departure, np.zeros(count)]),
    )


def dependences(known: Trajectories, rows: Rows, pool: ThreadPoolExecutor | None = None) -> list[Dependence]:
    """Dependence of a fit's residual on each quantity, the one that predicts best first."""
    fit = with_held_out(known.fit, rows)
    if fit is not known.fit:
        known = trajectories(fit)
    reach = reach_of(fit, rows, pool)
    base = following(linearised(known.fit, rows), rows, reach)
    alone = cross_validate(base, rows.blocks)
    before = float(np.sum(alone.error**2))
    n = len(alone.error)

    found: list[Dependence] = []
    for one in free_functions(known, pool):
        give_back()
        wide, count = beside(fit, base, one, rows, reach), len(one.columns)
        quantity, grid, basis = one.quantity, one.grid, one.basis
        del one  # its columns, which are large for long records, are now in `wide`
        predicted = cross_validate(wide, rows.blocks)
        coefficients = _coefficients(wide, rows.fitted)[-count:]
        del wide
        left = float(np.sum(predicted.error**2))
        floor = min(float(n), left)
        whole = max(before - floor, 1e-9 * before, 5.0 * math.sqrt(2.0 * n))
        drawn = coefficients @ basis if basis.size else np.empty(0)
        explained = float(np.clip((before - left) / whole, -1.0, 1.0))
        found.append(Dependence(quantity, explained, grid, drawn, predicted))
    return sorted(found, key=lambda one: -one.explained)


def _coefficients(fit: Linearised, fitted: int) -> Array:
    """Least-squares change of all parameters on the rows that the fit sees."""
    jacobian, residual = fit.jacobian[:fitted], fit.residual[:fitted]
    norms = column_norms(jacobian)
    normal = jacobian.T @ jacobian / np.outer(norms, norms) + np.diag(fit.precision / norms**2)
    pull = fit.precision * fit.departure / norms
    return -np.linalg.lstsq(normal, jacobian.T @ residual / norms + pull, rcond=1e-12)[0] / norms


def refitted_map(
    nominal: Trial,
    before: Sequence[Dependence],
    known: Trajectories,
    series: Sequence[Series],
    rows: Rows,
    step: float,
) -> tuple[str, Contender] | None:
    """Fit the free map of the quantity on which the nominal model's residual depends most, like any other model.

    The maps of `dependences` are first-order changes at a fit. They understate what another law would predict where the missing effect is
    large, or where named effects have biased the model's own parameters to compensate for it. The prediction of the refitted map measures
    what the names leave unexplained; the map itself is not a name.

    Parameters
    ----------
    nominal : the fitted nominal model.
    before : dependences of its residual on each quantity.
    known : its run.
    series, rows, step : the fitted series, the scored rows, and the largest integration step [s].

    Returns the quantity and the fitted model, or None where no free function of one quantity predicts anything or the model
    diverges with it.
    """
    best = max(
        (one for one in before if one.quantity in SPLINED), key=lambda one: one.explained, default=None
    )
    if best is None or best.explained <= 0.0:
        return None
    name = SPLINED[best.quantity]
    proposal = propose(
        nominal.model, FREE_MAPS[name], [first_guess(np.concatenate(values_of(known, name)))], nominal.added
    )
    trials, _ = run_trials([proposal], series, Origin.of(nominal), rows.noise, step)
    made = contend([(trial, "free_map") for trial in trials], series, rows, step)
    return (best.quantity, made[0]) if made else None
