"""Records that contradict one another: each alone agrees with the model, together they do not.

Different machines, or one machine in different settings, look like physics that is missing. Each record is fitted alone; where that leaves far less
than the best model of all records together, the records differ by more than what they were excited with.
"""

import math
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor

import numpy as np

from rhythmid.diagnose.search.forward import Search
from rhythmid.errors import InputError
from rhythmid.identify.free_run import prepare_run
from rhythmid.identify.output_error import Fit, minimise

LESS = 0.5  # share of the common error that records fitted alone have to fall below
APART = 10.0  # standard deviations by which a parameter differs
FAR = 0.05  # relative difference of that parameter


def contradiction(found: Search, pool: ThreadPoolExecutor | None = None) -> str | None:
    """Which parameter the records disagree about, as a reason; None where they go together as well as apart."""
    fit = found.nominal
    groups: dict[str, list[int]] = {}
    for index, one in enumerate(fit.run.series):
        record, _, window = one.name.partition("@")
        groups.setdefault(record if window else f"{one.name} ({index + 1})", []).append(index)
    if len(groups) < 2:
        return None
    alone: dict[str, Fit] = {}
    for name, places in groups.items():
        series = [fit.run.series[i] for i in places]
        try:
            run = prepare_run(fit.model, series, fit.run.max_step)
            alone[name] = minimise(
                fit.model, run, fit.names, fit.noise, [fit.starts[i] for i in places], 30, pool
            )
        except InputError:
            return None
    if _error(list(alone.values())) > LESS * _error([found.fit]):
        return None
    told = [(_distance(alone, name), name) for name in fit.names]
    far, worst = max(told)
    if far < APART:
        return None
    values = ", ".join(f"{one.model.value(worst):.4g} in {name}" for name, one in alone.items())
    return (
        f"the records contradict one another: each alone agrees with the nominal model, together they do not ({worst} is {values}); they may come "
        f"from different machines or settings, so diagnose them apart"
    )


def _error(fits: Sequence[Fit]) -> float:
    residuals = [r[one.used] for fit in fits for r, one in zip(fit.residuals, fit.run.series)]
    return float(np.sqrt(np.mean(np.concatenate(residuals) ** 2)))


def _distance(alone: dict[str, Fit], name: str) -> float:
    """By how many standard deviations the records disagree about a parameter; 0 where they differ little."""
    values = np.array([fit.model.value(name) for fit in alone.values()])
    stds = [fit.std[name] for fit in alone.values()]
    if not all(math.isfinite(s) for s in stds) or np.ptp(values) < FAR * np.abs(values).max():
        return 0.0
    return float(np.ptp(values) / max(math.hypot(*sorted(stds)[-2:]), 1e-300))
