"""Zeros that differ from record to record: whether the records need them, and the calibration with them.

A zero of each record is a hypothesis like any other. It is not missing physics, but physics can imitate it: with an asymmetric
stiffness, the mean of a motion shifts with its amplitude. The zeros are therefore adopted, for all hypotheses alike, only if they
predict data that the fit has not seen decisively better, both beside the nominal model and beside the effect of the catalogue that
explains the records best. The model with both must also follow the machine: a zero is a calibration, and must not compensate for a
machine that has changed from record to record. Where nothing restores the position, and the motion never comes back, a zero
is a position at which the record begins.
"""

from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

import numpy as np

from rhythmid.diagnose.baseline import Calibration
from rhythmid.diagnose.calibration_evidence import Seen
from rhythmid.diagnose.constants import FOLLOWS
from rhythmid.diagnose.free_functions import FreeFunction
from rhythmid.diagnose.search.proposals import is_restored
from rhythmid.elements.catalogue import Catalogue
from rhythmid.errors import InputError
from rhythmid.identify.output_error import Fit, estimate, rerun
from rhythmid.identify.record_scales import scales
from rhythmid.identify.record_zero import moved, others_marked, with_record_zero
from rhythmid.identify.series import Series, record_of
from rhythmid.identify.zero_estimates import zeros_of
from rhythmid.model import Model
from rhythmid.progress import Tell


def _zero_of_each(fit: Fit) -> FreeFunction:
    """A constant of each record but the first."""
    series = fit.run.series
    names = tuple(dict.fromkeys(record_of(one) for one in series))[1:]
    columns = tuple(
        tuple(np.full(one.blocks, float(record_of(one) == name)) for one in series) for name in names
    )
    return FreeFunction("zero", columns)


def with_zeros(
    calibration: Calibration,
    given: Model,
    unseen: Sequence[Series],
    catalogue: Catalogue,
    pool: ThreadPoolExecutor | None = None,
    tell: Tell = lambda _: None,
) -> tuple[Calibration, list[Series]]:
    """The calibration of the model `given` and the held-out series, with a zero of each record if the records need them.

    The zeros are subtracted from the series, so that scales and first guesses are those of one machine; the small remaining
    zeros stay free parameters.
    """
    fit, series, kept = calibration.fit, calibration.series, (calibration, list(unseen))
    if len({record_of(one) for one in series}) < 2 or series[0].measured != "position":
        return kept
    if not (scales(series, fit.model).comes_back or is_restored(fit)):
        return kept
    alone = Seen.of(fit, pool)
    if not alone.needs(alone.extended(_zero_of_each(alone.fit)), alone.base):
        return kept
    tell("the output's zero seems to differ from record to record; looking for an effect that says the same")
    explained = Seen.explained(fit, given, catalogue, pool, tell)
    both = explained.refitted(with_record_zero(explained.fit.model), others_marked(series), pool)
    if not explained.needs(both, explained.base, FOLLOWS):
        return kept
    tell("refitting with a zero of each record")
    try:
        free = estimate(with_record_zero(fit.model), others_marked(series), pool=pool)
        zeros = {name: value for name, (value, _) in zeros_of(free).items()}
        shifted = [_moved_by(one, zeros) for one in free.run.series]
        free = estimate(free.model, shifted, pool=pool)
    except InputError:
        return kept
    found = replace(calibration, fit=free, series=tuple(shifted))
    return found, [_of_unseen(one, free, zeros) for one in unseen]


def _moved_by(one: Series, zeros: Mapping[str, float]) -> Series:
    return moved(one, zeros[record_of(one)]) if record_of(one) in zeros else one


def _of_unseen(one: Series, fit: Fit, zeros: Mapping[str, float]) -> Series:
    """A held-out series without its zero: that of its record for a hidden end, a newly estimated one for a separate record."""
    if any(record_of(other) == record_of(one) for other in fit.run.series):
        return _moved_by(one, zeros)
    one = moved(one, 0.0)
    alone = rerun(fit.model, [one], fit.noise, fit.run.max_step)
    return one if alone is None else moved(one, zeros_of(alone)[record_of(one)][0])
