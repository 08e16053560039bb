"""How good the records of an identification are, and what the paper's method leaves of them."""

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from rhythmid.identify.paper import PaperResult
from rhythmid.identify.paper_conditions import LEAKAGE
from rhythmid.record.output_copy import copy_notes
from rhythmid.record.record import Record

MISFIT = 0.1  # of the magnitudes above which the fit is called into question


def notes_of(record: Record, result: PaperResult | None) -> Iterator[str]:
    """What should make a user doubt the record, or the paper's method where its `result` is shown."""
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
    """Figures of quality of the records and of their spectra, by name; those of spectra only with `results` of the paper's method."""
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
