"""Least squares with and without whitening: the one whose estimates scatter less.

Whitening by the colour of the residuals is efficient where they are noise that is added to the output. What goes with the motion is not: times
of arrival that jitter by more than a sample, physics that the model lacks. A filter that whitens it gives weight to
frequencies at which there is hardly any motion, and the estimates follow what is left there. Whitened and plain least
squares agree where the model is well specified (J. A. Hausman, Econometrica 46 (1978) 1251); the scores of blocks tell for either
how much its estimates scatter, whatever the residuals are.
"""

import numpy as np

from rhythmid.errors import InputError
from rhythmid.identify.noise import NoiseModel
from rhythmid.identify.output_error import Fit, minimise
from rhythmid.identify.robust_covariance import with_robust_covariance


def well_specified(fit: Fit) -> Fit:
    """The fit with standard deviations that its blocks' scores bear out; by plain least squares where whitening fails and that scatters less.

    Parameters
    ----------
    fit : whitened by the colour of its residuals. Whitening has failed where the scores of blocks scatter by more than white ones do.
    """
    whitened = with_robust_covariance(fit)
    if fit.noise.order == 0 or np.array_equal(whitened.covariance, fit.covariance):
        return whitened
    left = np.concatenate([r[one.used] for r, one in zip(fit.residuals, fit.run.series, strict=True)])
    white = NoiseModel(np.empty(0), float(np.sqrt(np.mean(left**2))))
    try:
        plain = minimise(fit.model, fit.run, fit.names, white, fit.starts)
    except InputError:
        return whitened
    plain = with_robust_covariance(plain)
    return plain if plain.converged and _scatter(plain, whitened) < 0.0 else whitened


def _scatter(one: Fit, other: Fit) -> float:
    """Mean logarithm of the ratio of two fits' variances, over the parameters that both determine."""
    variances = np.array([np.diag(one.covariance), np.diag(other.covariance)])
    known = np.all(np.isfinite(variances) & (variances > 0.0), axis=0)
    if not known.any():
        return 0.0
    return float(np.mean(np.log(variances[0, known] / variances[1, known])))
