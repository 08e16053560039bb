"""The confidence interval of a held command's period: all values that are likely.

The likelihood of the tick period is discontinuous (tick_likelihood.py), so that its curvature gives no interval. The likeliest of all
values tried around the fit is kept. The intervals of period and delay cover all values with a similar chi2, and sensitivities are
differences across them.
"""

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from rhythmid.diagnose.intervals import END, settled_at, widened
from rhythmid.diagnose.search.forward import Search
from rhythmid.errors import InputError
from rhythmid.identify.covariance import covariance_of
from rhythmid.identify.output_error import Fit, minimise
from rhythmid.identify.sample_clock.clock import clock_of
from rhythmid.identify.sample_clock.tick_likelihood import moved_to, places_of, tried, white_residual
from rhythmid.model import Model

Array = NDArray[np.float64]
LIKELY = 6.0  # excess of chi2 that covers 95 % of two parameters, here period and delay together


def ticks_followed(found: Search, pool: ThreadPoolExecutor | None = None) -> Search:
    """The search with the likeliest period (and input delay) of a drive's clock, and intervals that cover the likely values.

    Unchanged unless the search has added a clock and its period is free.
    """
    period = clock_of(found.fit.model)
    if period is None or period.split(".")[0] not in found.best.added or period not in found.fit.names:
        return found
    fit = found.fit
    places = places_of(fit)
    cases, costs = tried(fit, places, (), pool)
    likely = cases[costs < costs.min() + LIKELY]
    others = [name for place, name in enumerate(fit.names) if place not in places]
    try:
        best = moved_to(fit, places, cases[np.argmin(costs)])
        again = minimise(best, fit.run, others, fit.noise, fit.starts, pool=pool)
        if again.chi2 > fit.chi2:  # the other parameters do not follow linearly; the earlier fit is better
            again = fit
        values = np.array([again.model.value(name) for name in fit.names])
        reach = np.max(np.abs(likely - values[places]), axis=0)
        covariance = _covariance(fit, again.model, places, reach, pool)
    except InputError:
        return found
    new = replace(
        again, names=fit.names, values=values, covariance=covariance, linearisation=fit.linearisation
    )
    far = np.array([END * fit.std[name] for name in fit.names])
    far[places] = reach
    return settled_at(found, widened(new, far))


def _covariance(
    fit: Fit, model: Model, places: Sequence[int], reach: Array, pool: ThreadPoolExecutor | None
) -> Array:
    """Covariance (p, p) with the sensitivities to period and delay as differences across the likely range and its jumps."""
    jacobian = fit.linearisation.jacobian.copy()
    for place, step in zip(places, reach):
        name = fit.names[place]
        step = max(step, END * fit.std[name] if np.isfinite(fit.std[name]) else 0.0)
        if step == 0.0:
            continue
        low, high = model.parameters[name].bounds  # the delay of a nuisance may be negative
        values = np.clip(model.value(name) + step * np.array([1.0, -1.0]), low, high).tolist()
        ends = [model.with_values({name: value}) for value in values]
        outputs = fit.run.many([(end, fit.starts) for end in ends], pool)
        if outputs[0] is None or outputs[1] is None:
            raise InputError("the model diverges within the interval of a hold's period")
        change = white_residual(fit, [up - down for up, down in zip(*outputs)])
        jacobian[:, place] = change / (values[0] - values[1])
    return covariance_of(jacobian, [model.parameters[name].prior for name in fit.names])
