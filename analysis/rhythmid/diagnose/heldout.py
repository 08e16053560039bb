"""Held-out error: how a model does on what no fit has seen, separate records or the hidden end of the same ones."""

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from rhythmid.diagnose.search.forward import Search
from rhythmid.diagnose.search.refit import Trial, fine_enough
from rhythmid.errors import InputError
from rhythmid.identify.free_run import prepare_run
from rhythmid.identify.noise import runs
from rhythmid.identify.output_error import Fit, normalised_error, start_only
from rhythmid.identify.series import Series
from rhythmid.model import Model

Array = NDArray[np.float64]
NOISE = 1.21  # power of a held-out residual over that of a seen one, up to which it is the same noise


class HeldOut:
    """Errors of models on what their fit never saw: separate records, or the hidden end of the same ones."""

    def __init__(self, found: Search, separate: Sequence[Series] | None) -> None:
        self._found, self._separate = found, separate
        self._fits: dict[int, Fit | None] = {}

    def fit(self, model: Model) -> Fit | None:
        """Free run over separate held-out records, only their initial states estimated; None where there are none."""
        if self._separate is None:
            return None
        if id(model) not in self._fits:
            step = fine_enough(model, self._found.fit.run.max_step)
            try:
                self._fits[id(model)] = start_only(model, self._separate, self._found.noise, step)
            except InputError:
                self._fits[id(model)] = None
        return self._fits[id(model)]

    def nrmse(self, model: Model, own: Fit | None = None) -> float | None:
        """Held-out error of a model; `own` is its fit, needed when the held-out part is the end of the same records."""
        if self._separate is not None:
            fit = self.fit(model)
            return None if fit is None else fit.nrmse()
        if own is None:
            return None
        value = own.nrmse(hidden=True)
        return None if math.isnan(value) else value

    def uncarried(self) -> float:
        """Share of what the nominal model leaves of the held-out motion beyond noise that the chosen model leaves, too.

        Noise is what the chosen model leaves where it was fitted; held-out noise that is stronger shows as a rougher
        residual. 0 where nothing is held out.
        """
        fits = [self._found.fit, self._found.nominal]
        if self._separate is None:
            unseen = [_stretches(fit, hidden=True) for fit in fits]
        else:
            again = [self.fit(fit.model) for fit in fits]
            unseen = [[] if fit is None else _stretches(fit) for fit in again]
        if not all(unseen):
            return 0.0
        seen = _stretches(self._found.fit)
        rougher = _power([np.diff(r, 2) for r in unseen[0]]) / max(
            _power([np.diff(r, 2) for r in seen]), 1e-300
        )
        floor = _power(seen) * max(rougher, 1.0)
        chosen, nominal = (_power(stretches) for stretches in unseen)
        return 0.0 if chosen < NOISE * floor else (chosen - floor) / max(nominal - floor, chosen - floor)


def _stretches(fit: Fit, hidden: bool = False) -> list[Array]:
    """The residual where the fit saw it, or where it was hidden, in stretches without a gap that are long enough to judge."""
    parts = [
        residual[stretch]
        for residual, one in zip(fit.residuals, fit.run.series)
        for stretch in runs(one.counted(hidden))
    ]
    return [part for part in parts if len(part) > 2]


def _power(parts: Sequence[Array]) -> float:
    """Mean square of all parts together."""
    return float(np.mean(np.concatenate(parts) ** 2))


def tail_error(found: Search, trial: Trial) -> float | None:
    """Held-out error of a trial at the hidden end of its own records."""
    run = prepare_run(trial.model, found.fit.run.series, fine_enough(trial.model, found.fit.run.max_step))
    outputs = run.outputs(trial.model, trial.starts)
    if outputs is None:
        return None
    value = normalised_error(
        [output - one.averaged for output, one in zip(outputs, run.series)], run.series, True
    )
    return None if math.isnan(value) else value
