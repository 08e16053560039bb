"""Standard deviations of the parameters of an effort's fit due to small effects that the model lacks."""

import numpy as np
from numpy.typing import NDArray

from rhythmid.diagnose.discrepancy import mean_product
from rhythmid.diagnose.effort.candidate import columns_of, screen, starts_of
from rhythmid.diagnose.effort.fitted import Fitted
from rhythmid.diagnose.effort.reference import map_columns
from rhythmid.diagnose.effort.scales import scales_at
from rhythmid.elements.catalogue import Catalogue
from rhythmid.identify.inverse_dynamics.balance import Balance
from rhythmid.identify.inverse_dynamics.estimate import size_of
from rhythmid.identify.inverse_dynamics.free_map import FreeMap
from rhythmid.identify.robust_covariance import root_weights, weighted

Array = NDArray[np.float64]


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
