"""The interval of a held command's period: whatever of it is likely.

The likelihood of the ticks jumps (tick_likelihood.py), and no curvature tells how far it reaches. The likeliest of all cases tried
around the fit goes on, the intervals of period and delay hold those of a chi2 as good, and sensitivities are taken across them.
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
LIKELY = 6.0  # of chi2 above the best, up to which 95 % of two parameters are, here period and delay together


def ticks_followed(found: Search, pool: ThreadPoolExecutor | None = None) -> Search:
    """The search with the likeliest period (and input delay) of a drive's clock, and intervals that hold what is likely; as it is
    without a clock that the search has added and whose period is free."""
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
        if again.chi2 > fit.chi2:  # all else does not follow linearly, and the fit is as good as it gets
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
    """Covariance (p, p) with the sensitivities to period and delay taken over what is likely, across the jumps."""
    jacobian = fit.linearisation.jacobian.copy()
    for place, step in zip(places, reach):
        name = fit.names[place]
        step = max(step, END * fit.std[name] if np.isfinite(fit.std[name]) else 0.0)
        if step == 0.0:
            continue
        low, high = model.parameters[name].bounds  # a nuisance's delay may lie below zero
        values = np.clip(model.value(name) + step * np.array([1.0, -1.0]), low, high).tolist()
        ends = [model.with_values({name: value}) for value in values]
        outputs = fit.run.many([(end, fit.starts) for end in ends], pool)
        if outputs[0] is None or outputs[1] is None:
            raise InputError("the model diverges within the interval of a hold's period")
        change = white_residual(fit, [up - down for up, down in zip(*outputs)])
        jacobian[:, place] = change / (values[0] - values[1])
    return covariance_of(jacobian, [model.parameters[name].prior for name in fit.names])
