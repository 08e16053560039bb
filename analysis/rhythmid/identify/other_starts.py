"""Other starts of a fit, where its own one may lead to a minimum that is not the deepest."""

from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress

import numpy as np

from rhythmid.errors import InputError
from rhythmid.identify.multiple_shooting import periods_long, split
from rhythmid.identify.output_error import Fit, estimate, minimise
from rhythmid.identify.search_quality import POOR_MOTION
from rhythmid.identify.series import Series
from rhythmid.model import Model

WINDOWS = 60  # short windows that are fitted, beside the first of each series
# error, as a share of the motion, up to which the model follows a fit's series. At another minimum it parts from the motion
# somewhere, by a part of it; of a pendulum that turns over, a tenth of the whole is a turn
SETTLED = 0.01
ITERATIONS = 12  # of a fit that only gives a start


def from_windows(
    model: Model, series: Sequence[Series], pool: ThreadPoolExecutor | None = None, deeper: bool = True
) -> Fit:
    """The fit from the values and initial states of short windows with initial states of their own, in which wrong values cannot drift far.

    Values alone are not enough where a machine parts from a motion that begins a little elsewhere, as a pendulum does near its
    upper rest: a run with the right values and a rough initial state ends in another turn. Where the model does not follow the windows
    either, and `deeper`, their fit starts from shorter ones.
    Raises InputError where the model diverges, or does not follow short windows.
    """
    length = float(np.median([periods_long(one) for one in series]))
    windows, firsts = list[Series](), list[int]()
    for one in series:
        firsts.append(len(windows))
        windows += split(one, length)
    chosen = sorted({*firsts, *range(0, len(windows), max(1, len(windows) // WINDOWS))})
    cut = [windows[index] for index in chosen]
    short = estimate(model, cut, iterations=ITERATIONS, pool=pool)
    if deeper and short.nrmse() > SETTLED and len(windows) > len(series):
        with suppress(InputError):  # too short to simulate
            again = from_windows(model, cut, pool, deeper=False)
            short = again if again.sum_of_squares < short.sum_of_squares else short
    if short.nrmse() > POOR_MOTION:
        raise InputError(
            "the model does not follow the motion in short windows either, which therefore give no start"
        )
    starts = [short.starts[chosen.index(first)] for first in firsts]
    return estimate(short.model, series, starts=starts, pool=pool)


def from_delays(
    fit: Fit, delays: Mapping[str, Sequence[float] | np.ndarray], pool: ThreadPoolExecutor | None = None
) -> Fit:
    """The fit, or the best one from these `delays` [s], by name, if it is better: a delay half a period of the motion away is another local minimum."""
    best = fit
    for name, tried in delays.items():
        for delay in tried:
            model = fit.model.with_values({name: delay})
            try:
                trial = minimise(model, fit.run, fit.names, fit.noise, fit.starts, ITERATIONS, pool)
            except InputError:
                continue
            if trial.chi2 < best.chi2:
                best = trial
    return fit if best is fit else estimate(best.model, fit.run.series, pool=pool)
