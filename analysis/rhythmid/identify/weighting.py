"""Weighted or ordinary least squares: of the two the one whose estimates scatter less.

Weighting by the colour of the residuals is efficient where they are noise that is added to the output. What goes with the
motion is not: times of arrival that jitter by more than a sample, physics that the model lacks. A filter that whitens
it gives weight to frequencies at which there is hardly any motion, and the estimates follow what is left there. The scores of blocks tell
for either fit how much its estimates scatter, whatever the residuals are. That the two agree where the model is right, and
need not where it is wrong: J. A. Hausman, Econometrica 46 (1978) 1251.
"""

import math

import numpy as np

from rhythmid.errors import InputError
from rhythmid.identify.noise import NoiseModel
from rhythmid.identify.output_error import Fit, minimise
from rhythmid.identify.robust_covariance import with_robust_covariance


def efficient_fit(fit: Fit) -> Fit:
    """The fit with standard deviations that its blocks' scores bear out, or the ordinary one where that scatters less.

    Parameters
    ----------
    fit : weighted by the colour of its residuals. An ordinary one is made only where the scores of its blocks scatter by more
        than those of noise do.
    """
    weighted = with_robust_covariance(fit)
    if fit.noise.order == 0 or np.array_equal(weighted.covariance, fit.covariance):
        return weighted
    ordinary = fit
    try:
        for _ in range(2):  # first to the minimum, then for the noise that is left there
            ordinary = minimise(ordinary.model, fit.run, fit.names, _white(ordinary), ordinary.starts)
    except InputError:
        return weighted
    ordinary = with_robust_covariance(ordinary)
    return ordinary if ordinary.converged and _scatter(ordinary, weighted) < 0.0 else weighted


def _white(fit: Fit) -> NoiseModel:
    """White noise as large as what the fit leaves."""
    left = np.concatenate([r[one.used] for r, one in zip(fit.residuals, fit.run.series, strict=True)])
    return NoiseModel(np.empty(0), math.sqrt(float(np.mean(left**2))))


def _scatter(one: Fit, other: Fit) -> float:
    """Mean logarithm of the ratio of two fits' variances, over the parameters that both determine."""
    variances = np.array([np.diag(one.covariance), np.diag(other.covariance)])
    known = np.all(np.isfinite(variances) & (variances > 0.0), axis=0)
    if not known.any():
        return 0.0
    return float(np.mean(np.log(variances[0, known] / variances[1, known])))
