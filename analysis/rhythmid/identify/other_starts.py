"""Other starts of a fit, where its own one may lead to a minimum that is not the deepest."""

from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor

import numpy as np

from rhythmid.errors import InputError
from rhythmid.identify.multiple_shooting import split
from rhythmid.identify.output_error import Fit, estimate, minimise
from rhythmid.identify.series import Series, dominant_frequency
from rhythmid.model import Model

WINDOWS = 60  # short windows that are fitted, spread over all records


def from_windows(model: Model, series: Sequence[Series], pool: ThreadPoolExecutor | None = None) -> Model:
    """Start values from short windows with initial states of their own, in which wrong values cannot drift far."""
    length = 2.0 / max(dominant_frequency(one) for one in series)
    windows = [part for one in series for part in split(one, length)]
    return estimate(model, windows[:: max(1, len(windows) // WINDOWS)], iterations=12, pool=pool).model


def from_delays(
    fit: Fit, delays: Mapping[str, Sequence[float] | np.ndarray], pool: ThreadPoolExecutor | None = None
) -> Fit:
    """The fit, or the best one from these `delays` [s], by name, if it is better: a delay half a period of the motion away is another local minimum."""
    best = fit
    for name, tried in delays.items():
        for delay in tried:
            model = fit.model.with_values({name: delay})
            try:
                trial = minimise(model, fit.run, fit.names, fit.noise, fit.starts, 12, pool)
            except InputError:
                continue
            if trial.chi2 < best.chi2:
                best = trial
    return fit if best is fit else estimate(best.model, fit.run.series, pool=pool)
