"""Zeros that differ from record to record, detected by a fit to several records: each becomes a nuisance parameter
of the fit."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from rhythmid.errors import InputError
from rhythmid.identify.joint import JointFit
from rhythmid.identify.least_squares import column_norms
from rhythmid.identify.output_error import Fit, estimate, minimise
from rhythmid.identify.record_zero import others_marked, with_record_zero
from rhythmid.identify.robust_covariance import widening
from rhythmid.identify.search_quality import explained
from rhythmid.identify.sensitivity import Problem
from rhythmid.identify.series import record_of
from rhythmid.identify.timing import EVIDENT_BY
from rhythmid.identify.zero_estimates import zeros_told

Array = NDArray[np.float64]
# share of the squared error that free zeros may leave: they must explain nearly all of it. A larger rest may be an
# effect that shifts the mean with the amplitude, which only a search among effects can tell (a hopper with a
# quadratic spring leaves 0.36)
LEFT = 0.2


def zero_scores(fit: Fit) -> Array:
    """Deviation of each record's zero from that of the first, in standard deviations, (r - 1,), to first order.

    White noise is assumed, because the effect of a missing element is not noise. The standard deviations are
    confirmed by the scores of blocks.
    """
    fit = minimise(fit.model, fit.run, fit.names, fit.white, fit.starts, 10, differences=fit.differences)
    here, series = fit.linearisation, fit.run.series
    problem = Problem(fit.run, fit.names, fit.noise, None)
    names = tuple(dict.fromkeys(record_of(one) for one in series))[1:]
    parts = []
    for index, (one, basis) in enumerate(zip(series, here.bases, strict=True)):
        constant = problem.whitened(index, np.ones(one.blocks))
        constant = constant - basis @ (basis.T @ constant)
        parts.append(np.outer(constant, [float(record_of(one) == name) for name in names]))
    columns = np.hstack([here.jacobian, np.concatenate(parts)])
    norms = column_norms(columns)
    normal = (columns / norms).T @ (columns / norms)
    inverse = np.asarray(np.linalg.pinv(normal, rcond=1e-12), dtype=np.float64)
    step = -inverse @ ((columns / norms).T @ here.residual)
    std = np.sqrt(np.maximum(np.diag(inverse), 1e-300))
    remainder = here.residual + (columns / norms) @ step
    factors = widening(columns / norms, remainder, here.pieces, inverse, std)
    return (step / (std * factors))[-len(names) :]


def with_own_zeros(joint: JointFit) -> tuple[JointFit, tuple[str, ...]]:
    """The fit with a zero for each record where the records differ in it, and messages about the zeros."""
    fit, kept = joint.fit, (joint, ())
    series = fit.run.series
    several = len({record_of(one) for one in series}) > 1
    if not several or series[0].measured != "position" or any(one.ignored is not None for one in series):
        return kept
    try:
        if np.abs(zero_scores(fit)).max() < EVIDENT_BY:
            return kept
        free = estimate(with_record_zero(fit.model), others_marked(series), max_step=fit.run.max_step)
        # a stuck fit improves when it is repeated, whatever else is free
        values = {name: free.model.value(name) for name in fit.names}
        again = estimate(fit.model.with_values(values), series, max_step=fit.run.max_step)
    except InputError:
        return kept
    before, other, after = (one.sum_of_squares for one in (fit, again, free))
    before = min(before, other)
    if after > LEFT * before:
        return kept
    return replace(joint, fit=free, search=explained(free, joint.pumping)), zeros_told(free)
