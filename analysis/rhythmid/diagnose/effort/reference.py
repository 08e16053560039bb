"""Unknown physics as a competitor: a model with a free map of the motion beside its own elements."""

import numpy as np
from numpy.typing import NDArray

from rhythmid.diagnose.effort.fitted import Fitted
from rhythmid.diagnose.evidence import Blocks, Linearised, predict
from rhythmid.identify.inverse_dynamics.balance import Balance
from rhythmid.identify.inverse_dynamics.estimate import linearise, size_of
from rhythmid.identify.inverse_dynamics.free_map import FreeMap
from rhythmid.identify.student import scale_of, weights_of

Array = NDArray[np.float64]
# standard deviations of a map's bends (second differences of a spline's coefficients), of which cross-validation chooses: shares of
# the effort's size. The smallest leaves straight lines, the largest a tenth of the effort for every piece
RIDGES = (0.3, 0.1, 0.03, 0.01, 0.003)
STRAIGHT = 3.0  # standard deviation of what is straight, the same: a line may carry all of the effort
PASSES = 8  # of reweighted least squares


def map_columns(
    balance: Balance, fitted: Fitted, drawn_on: Balance | None = None, beside: str | None = None
) -> tuple[Array, NDArray[np.bool_]]:
    """Columns (n, q) of the free map at the rows, and which of them are bends (q,); its load is the effort that the model
    predicts, never the measured one. The map's pieces lie where the motions of `drawn_on` are, by default the balance's own; it is
    one of the motion of the joint `beside` this one, too."""
    drawn_on = drawn_on or balance
    free = FreeMap(list(drawn_on.motions), beside)
    loads = balance.required(fitted.fit.model)
    made = [free.columns(motion, load) for motion, load in zip(balance.motions, loads, strict=True)]
    shift = balance.shift(fitted.fit.model) + fitted.fit.alignment
    columns = balance.rows(made, shift)
    columns[:, -1] /= size_of(drawn_on)  # a load counts as a share of the effort
    return columns, free.bends


def with_map(
    balance: Balance, fitted: Fitted, ridge: float, columns: tuple[Array, NDArray[np.bool_]]
) -> Linearised:
    """The fit with a free map, of these `map_columns`, beside its parameters; `ridge` is the standard deviation of the map's
    bends, as a share of the effort's size."""
    base = fitted.linearised
    made, bends = columns
    jacobian = np.hstack([base.jacobian, made])
    spread = np.where(bends, ridge, STRAIGHT) * size_of(balance)
    precision = np.concatenate([base.precision, spread**-2])
    departure = np.concatenate([base.departure, np.zeros(made.shape[1])])
    residual = base.residual
    for _ in range(PASSES):
        scale = scale_of(residual)
        weight = weights_of(residual, scale) / scale**2
        normal = (jacobian * weight[:, None]).T @ jacobian + np.diag(precision)
        scaling = 1.0 / np.sqrt(np.diag(normal))
        slope = jacobian.T @ (weight * residual) + precision * departure
        step = (
            -scaling * np.linalg.lstsq(normal * np.outer(scaling, scaling), scaling * slope, rcond=1e-12)[0]
        )
        residual, departure = residual + jacobian @ step, departure + step
    return Linearised(residual, jacobian, precision, departure)


def residual_with_map(
    heldout: Balance, balance: Balance, fitted: Fitted, found: Linearised, beside: str | None = None
) -> Array:
    """Predicted less recorded effort (n,) of held-out rows, by a fit with a free map that was `found` on a balance."""
    residual, jacobian = linearise(heldout, fitted.fit.model, fitted.fit.names, fitted.fit.alignment)
    own = jacobian[:, ~fitted.fit.at_limit]
    step = found.departure[: own.shape[1]] - fitted.linearised.departure
    mapped = map_columns(heldout, fitted, balance, beside)[0] @ found.departure[own.shape[1] :]
    return residual + own @ step + mapped


def reference_of(balance: Balance, fitted: Fitted, blocks: Blocks, beside: str | None = None) -> Linearised:
    """The map whose ridge predicts best what it has not seen; with the motion of the joint `beside` this one, where one is named."""
    columns = map_columns(balance, fitted, beside=beside)
    made = [with_map(balance, fitted, ridge, columns) for ridge in RIDGES]
    found = predict(made, blocks, balance.record)
    return made[int(np.argmax([one.score for one in found]))]
