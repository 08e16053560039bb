"""Chooses between weighted and ordinary least squares: the fit with the smaller scatter of its estimates.

Whitening by the residuals' noise model is efficient where they are noise added to the output. Two kinds of residual
are correlated with the motion instead: arrival times with a jitter of more than a sample, and effects that the
model lacks. There whitening gives weight to frequencies with hardly any motion, and the estimates follow the
residual there. For either fit the scores of blocks measure the scatter of the estimates, whatever the residuals
are. The two fits agree for a correct model and may differ for a wrong one: J. A. Hausman, Econometrica 46 (1978)
1251.
"""

import numpy as np

from rhythmid.errors import InputError
from rhythmid.identify.output_error import Fit, minimise
from rhythmid.identify.robust_covariance import with_robust_covariance


def efficient_fit(fit: Fit) -> Fit:
    """The fit with standard deviations confirmed by its blocks' scores, or the ordinary one where that scatters less.

    Parameters
    ----------
    fit : weighted by the noise model of its residuals. An ordinary fit is made only where the scores of its blocks
        scatter by more than those of noise.
    """
    weighted = with_robust_covariance(fit)
    if fit.noise.order == 0 or np.array_equal(weighted.covariance, fit.covariance):
        return weighted
    ordinary = fit
    try:
        for _ in range(2):  # first to the minimum, then with the noise level of the residual there
            ordinary = minimise(ordinary.model, fit.run, fit.names, ordinary.white, ordinary.starts)
    except InputError:
        return weighted
    ordinary = with_robust_covariance(ordinary)
    return ordinary if ordinary.converged and _scatter(ordinary, weighted) < 0.0 else weighted


def _scatter(one: Fit, other: Fit) -> float:
    """Mean logarithm of the ratio of two fits' variances, over the parameters that are identifiable in both."""
    variances = np.array([np.diag(one.covariance), np.diag(other.covariance)])
    known = np.all(np.isfinite(variances) & (variances > 0.0), axis=0)
    if not known.any():
        return 0.0
    return float(np.mean(np.log(variances[0, known] / variances[1, known])))
