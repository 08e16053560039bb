"""Quality of the records of an identification, and misfit of the paper's method."""

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rhythmid.identify.declared import own_model
from rhythmid.identify.paper import PaperResult
from rhythmid.identify.paper_conditions import LEAKAGE
from rhythmid.model import Model
from rhythmid.record.output_copy import copy_notes
from rhythmid.record.record import Record
from rhythmid.simulation.signal import continuous, spline
from rhythmid.simulation.simulate import simulate

Array = NDArray[np.float64]
MISFIT = 0.1  # misfit of the magnitudes above which a note is given


def notes_of(record: Record, result: PaperResult | None) -> Iterator[str]:
    """Reasons to doubt the record, or the paper's method where its `result` is shown."""
    yield from (f"{record.name}: {note}" for note in (*record.quality.notes, *copy_notes(record)))
    if result is None:
        return
    window, operator = result.spectra.window, result.estimate.operator
    if window.leakage > LEAKAGE:
        yield (
            f"{record.name}: the command does not repeat over whole pumping periods, so its response leaks "
            f"({window.leakage:.0%}): begin with a warm-up repetition, or leave silence at both ends"
        )
    apart = operator.spacing * operator.spectra.resolution
    if apart * np.pi * result.fit.linearised.cycle.ring_down > 1.0:
        yield (
            f"{record.name}: the excited frequencies are {apart:.3g} Hz apart, wider than the machine's resonance: HTFs "
            "between them are interpolated; excite denser lines"
        )
    if result.fit.misfit > MISFIT:
        yield f"{record.name}: the model leaves {result.fit.misfit:.0%} of the HTFs' magnitudes unexplained"


def quality_of(nrmse: float, records: Sequence[Record], results: Sequence[PaperResult]) -> dict[str, Any]:
    """Quality measures of the records and of their spectra, by name; those of spectra only with `results` of the
    paper's method."""
    channels = [record.quality for record in records]
    quality = {
        "rate": 1.0 / records[0].output.period,
        "gaps": sum(q.gaps for q in channels if q.channels),
        "jitter_std": max((q.jitter_std for q in channels if q.channels), default=0.0),
        "nrmse": nrmse,
    }
    if not results:
        return quality
    first = results[0]
    return quality | {
        "periods": first.spectra.window.periods,
        "leakage": first.spectra.window.leakage,
        "smoothing_window": first.estimate.operator.window,
        "smoothing_loss": {f"{m:+d}": float(v) for m, v in zip(first.estimate.htf.harmonics, first.loss)},
    }


def free_run_nrmse(model: Model, record: Record, start: Array) -> float:
    """rms(simulated − measured) / std(measured) in free-run simulation from the state `start` at the first sample."""
    command = None if record.input is None else continuous(record.input.time, record.input.value, record.hold)
    forcing = None if record.forcing is None else spline(record.forcing.time, record.forcing.value)
    simulated = simulate(model, record.output.time, command, forcing, start).output
    return float(np.sqrt(np.mean((simulated - record.output.value) ** 2)) / np.std(record.output.value))


def cycle_nrmse(model: Model, records: Sequence[Record], results: Sequence[PaperResult]) -> float:
    """Largest free-run NRMSE of a model that starts on its limit cycle."""
    nrmse = 0.0
    for record, result in zip(records, results):
        cycle, delay = result.fit.linearised.cycle, model.value("measurement_delay.delay")
        begin = (record.output.time[0] - delay - result.pumping.origin) % result.pumping.period
        nrmse = max(nrmse, free_run_nrmse(own_model(model, record), record, cycle.path(begin)))
    return nrmse
