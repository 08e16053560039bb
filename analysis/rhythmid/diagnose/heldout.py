"""Held-out error: how a model does on what no fit has seen, separate records or the hidden end of the same ones."""

import math
from collections.abc import Sequence

from rhythmid.diagnose.refit import Trial, fine_enough
from rhythmid.diagnose.search import Search
from rhythmid.errors import InputError
from rhythmid.identify.free_run import prepare_run
from rhythmid.identify.output_error import Fit, normalised_error, start_only
from rhythmid.identify.series import Series
from rhythmid.model import Model


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
        value = own.nrmse(unused=True)
        return None if math.isnan(value) else value


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
