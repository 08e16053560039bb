"""Errors of a fitted motion's parameters due to small effects that the model lacks."""

from itertools import chain

import numpy as np
from numpy.typing import NDArray

from rhythmid.diagnose.case import Case
from rhythmid.diagnose.discrepancy import mean_product
from rhythmid.diagnose.free_functions import motion_maps
from rhythmid.diagnose.search.forward import Search
from rhythmid.diagnose.search.round import distinct
from rhythmid.diagnose.search.score_tests import changes_of, sizes_along, trajectories, whitened
from rhythmid.elements.candidates import candidates
from rhythmid.elements.catalogue import Catalogue
from rhythmid.identify.covariance import covariance_of


def small_effects(found: Search, catalogue: Catalogue, case: Case) -> NDArray[np.float64]:
    """Mean product (p, p) of the fit's parameter errors due to small effects that it lacks.

    The effects are: for each element that the model may lack, the guess with the best score in the last round; and forces
    that are arbitrary functions of position or velocity.
    """
    fit = found.fit
    made = np.zeros((len(fit.names), len(fit.names)))
    run = trajectories(fit)
    lacking = candidates(catalogue, fit.model.setting, sizes_along(run)).tried
    names = {element.name for element, _ in lacking}
    scored = distinct(found.rounds[-1].scores, len(catalogue)) if found.rounds else []
    tried = [(one.element, dict(one.values)) for one, _ in scored if one.element.name in names]
    std = np.array([fit.std[name] for name in fit.names])
    known = np.isfinite(std) & (std > 0.0)
    if not known.any():
        return made
    line = fit.linearisation
    maps = [column for one in motion_maps(run, case.pool) for column in one.columns]
    # filled in place: for long records a second copy of all columns would be too large
    columns = np.empty((len(line.residual), len(tried) + len(maps)), order="F")
    count = 0
    for outputs in chain((one.outputs for one in changes_of(run, tried, case.pool)), maps):
        columns[:, count] = line.without_starts(whitened(fit, outputs, fit.noise))
        count += 1
    columns = columns[:, :count]
    priors = [fit.model.parameters[name].prior for name, one in zip(fit.names, known) if one]
    inverse = covariance_of(line.jacobian[:, known], priors)
    motion = whitened(fit, [one.averaged - one.averaged.mean() for one in fit.run.series], fit.noise)
    signal = float(np.linalg.norm(line.without_starts(motion)))
    made[np.ix_(known, known)] = mean_product(
        line.jacobian[:, known], line.residual, columns, inverse, signal
    )
    return made
