"""Effect of discretisation on estimates: a systematic error, and the only error where a record has no noise.

A fit integrates in steps of about a block. It takes the average over a block's samples from differences between
blocks. Here both approximations are removed: steps of half the size, and every sample simulated. The difference is
passed through the estimator like a residual and gives the shift of each estimate. The square of the shift is added
to the variance.
"""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from rhythmid.identify.covariance import covariance_of
from rhythmid.identify.free_run import FreeRun, with_series
from rhythmid.identify.output_error import Fit
from rhythmid.identify.sensitivity import Problem
from rhythmid.model import Model

Array = NDArray[np.float64]


def discretisation_error(fit: Fit) -> Array:
    """Whitened change of all outputs when nothing is approximated, in the rows (n,) of `fit.linearisation`. The
    part that the initial states can absorb is projected out. Zero where the model diverges."""
    problem = Problem(fit.run, fit.names, fit.noise, None)
    coarse = fit.run.outputs(fit.model, fit.starts)
    parts = []
    for index, basis in enumerate(fit.linearisation.bases):
        fine = _block_averages(fit.run, index, fit.model, fit.starts[index])
        if coarse is None or fine is None:
            return np.zeros(len(fit.linearisation.residual))
        change = np.concatenate([[0.0], fine - coarse[index][1:]])
        white = problem.whitened(index, change)
        parts.append(white - basis @ (basis.T @ white))
    return np.concatenate(parts)


def _block_averages(run: FreeRun, index: int, model: Model, start: Array) -> Array | None:
    """Averages (blocks - 1,) of the output over the samples of all blocks but the first; `start` is the state at
    the middle of the first."""
    one = run.series[index]
    later = one.time[one.block : one.blocks * one.block]
    times = np.concatenate([one.centres[:1], later])
    every = replace(
        one, block=1, time=times, value=np.zeros(len(times)), used=np.ones(len(times), bool), hidden=None
    )
    # steps end at the knots of a command that a smooth surrogate may replace
    fine = with_series(run, index, every)
    rows = replace(fine, max_step=0.5 * run.max_step).rows(model, index, start)
    return None if rows is None else rows[1:, run.states].reshape(-1, one.block).mean(axis=1)


def with_discretisation_error(fit: Fit) -> Fit:
    """The fit with the discretisation error added to its covariance.

    The estimator that the error passes through is that of the information: standard deviations that block scores
    have widened describe how much the estimates scatter, not how they follow the outputs.
    """
    jacobian = fit.linearisation.jacobian
    inverse = covariance_of(jacobian, [fit.model.parameters[name].prior for name in fit.names])
    known = np.isfinite(np.diag(inverse)) & np.isfinite(np.diag(fit.covariance))
    if not known.any():
        return fit
    moved = inverse[np.ix_(known, known)] @ (jacobian[:, known].T @ discretisation_error(fit))
    covariance = fit.covariance.copy()
    covariance[np.ix_(known, known)] += np.outer(moved, moved)
    return replace(fit, covariance=covariance)
