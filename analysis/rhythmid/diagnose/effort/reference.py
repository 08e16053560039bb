"""Unknown physics as a competing model: a free function of the motion beside the model's own elements."""

from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from rhythmid.diagnose.effort.fitted import Fitted
from rhythmid.diagnose.evidence import Blocks, Linearised, predict
from rhythmid.diagnose.hypothesis import Prediction
from rhythmid.identify.inverse_dynamics.balance import Balance
from rhythmid.identify.inverse_dynamics.estimate import linearise, size_of
from rhythmid.identify.inverse_dynamics.free_map import FreeMap
from rhythmid.identify.inverse_dynamics.history_map import HistoryMap
from rhythmid.identify.inverse_dynamics.motion import Motion
from rhythmid.identify.student import scale_of, weights_of

Array = NDArray[np.float64]
# candidate standard deviations of a map's bends, as shares of the effort's size; cross-validation selects one. Bends are second
# differences of a spline's coefficients, or values of a function of the motion and its past. The smallest leaves straight
# lines, the largest a tenth of the effort for every piece
RIDGES = (0.3, 0.1, 0.03, 0.01, 0.003)
# standard deviation of the straight part, in the same unit: a line may carry all of the effort
STRAIGHT = 3.0
PASSES = 8  # iterations of reweighted least squares
HISTORY = "the motion and its past"  # the quantity of a map of several quantities and their past


class Map(Protocol):
    """Columns of a free function along motions; `bends` (q,) marks the columns that describe curvature."""

    bends: NDArray[np.bool_]

    def columns(self, motion: Motion, load: Array) -> Array:
        """Columns (n, q) of one motion; `load` (n,) is the effort that a model predicts, never the measured one."""
        ...


@dataclass(frozen=True, eq=False)
class Mapped:
    """A fit with a free map beside its parameters."""

    map: Map
    linearised: Linearised


def map_columns(balance: Balance, fitted: Fitted, free: Map) -> Array:
    """Columns (n, q) of a free map at the rows of a balance."""
    loads = balance.required(fitted.fit.model)
    made = (free.columns(motion, load) for motion, load in zip(balance.motions, loads, strict=True))
    return balance.rows(made, balance.later(fitted.fit.model, fitted.fit.alignment))


def _with_map(balance: Balance, fitted: Fitted, ridge: float, free: Map, columns: Array) -> Mapped:
    """The fit with a free map of these `columns` beside its parameters.

    `ridge` is the standard deviation of the map's bends, as a share of the effort's size.
    """
    base = fitted.linearised
    jacobian = np.hstack([base.jacobian, columns])
    spread = np.where(free.bends, ridge, STRAIGHT) * size_of(balance)
    precision = np.concatenate([base.precision, spread**-2])
    departure = np.concatenate([base.departure, np.zeros(columns.shape[1])])
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
    return Mapped(
        free, Linearised(residual, jacobian, precision, departure, np.full_like(base.rests, np.nan))
    )


def residual_with_map(heldout: Balance, fitted: Fitted, found: Mapped) -> Array:
    """Predicted less recorded effort (n,) of held-out rows, for a fit with a free map."""
    residual, jacobian = linearise(heldout, fitted.fit.model, fitted.fit.names, fitted.fit.alignment)
    own = jacobian[:, ~fitted.fit.at_limit]
    values = found.linearised.departure
    step = values[: own.shape[1]] - fitted.linearised.departure
    return residual + own @ step + map_columns(heldout, fitted, found.map) @ values[own.shape[1] :]


def reference_of(balance: Balance, fitted: Fitted, blocks: Blocks, beside: str | None = None) -> Mapped:
    """A fit with curves over the quantities of the motion, including the motion of the joint `beside`, if given."""
    return _best(balance, fitted, blocks, FreeMap(list(balance.motions), size_of(balance), beside))


def history_of(balance: Balance, fitted: Fitted, blocks: Blocks) -> Mapped:
    """A fit with a free function of the motion and its past."""
    loads = balance.required(fitted.fit.model)
    return _best(balance, fitted, blocks, HistoryMap(balance.motions, balance.places, loads))


def beyond_noise(mapped: Prediction, plain: Prediction, noise: float) -> Prediction:
    """The prediction of a fit with a free map, as far as it is better than the fit without by more than `noise`.

    `noise` is the mean square of the motion's noise in the effort, which the map may predict; see `noise_power`.
    """
    gain = plain.mean_square - mapped.mean_square
    if gain <= 0.0:
        return mapped
    real = max(1.0 - noise / gain, 0.0)
    return replace(
        mapped,
        log_density=plain.log_density + real * (mapped.log_density - plain.log_density),
        squared_error=plain.squared_error + real * (mapped.squared_error - plain.squared_error),
    )


def _best(balance: Balance, fitted: Fitted, blocks: Blocks, free: Map) -> Mapped:
    """The map with the ridge that predicts held-out blocks best."""
    columns = map_columns(balance, fitted, free)
    made = [_with_map(balance, fitted, ridge, free, columns) for ridge in RIDGES]
    found = predict([one.linearised for one in made], blocks, balance.record)
    return made[int(np.argmax([one.score for one in found]))]
