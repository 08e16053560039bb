"""Zeros that differ from record to record: whether the records need them, and the calibration with them.

A zero of each record is a hypothesis like any other. It is not missing physics, but physics can imitate it: with an asymmetric
stiffness, the mean of a motion shifts with its amplitude. The zeros are therefore adopted, for all hypotheses alike, only if they
predict data that the fit has not seen decisively better, both beside the nominal model and beside the effect of the catalogue that
explains the records best. The model with both must also follow the machine: a zero is a calibration, and must not compensate for a
machine that has changed from record to record. The output is linear in its zeros, so that beside the nominal model first-order
cross-validation is exact in them. Beside the effect, both are fitted together.
"""

import math
from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from rhythmid.diagnose.baseline import Calibration
from rhythmid.diagnose.constants import FOLLOWS, PRACTICAL
from rhythmid.diagnose.contenders import Rows, linearised, rows_of
from rhythmid.diagnose.evidence import Linearised, predict, weight_for
from rhythmid.diagnose.free_functions import FreeFunction
from rhythmid.diagnose.location import Reach, beside, following, reach_of
from rhythmid.diagnose.rejections import decisive
from rhythmid.diagnose.search.forward import search
from rhythmid.diagnose.search.score_tests import under
from rhythmid.elements.catalogue import Catalogue
from rhythmid.errors import InputError
from rhythmid.identify.noise import NoiseModel
from rhythmid.identify.output_error import Fit, estimate, rerun
from rhythmid.identify.record_scales import scales
from rhythmid.identify.record_zero import moved, others_marked, with_record_zero
from rhythmid.identify.series import Series, record_of
from rhythmid.identify.zero_estimates import zeros_of
from rhythmid.model import Model
from rhythmid.progress import Tell

Array = NDArray[np.float64]


@dataclass(frozen=True)
class _Seen:
    """A fit under white noise, with the data for its predictions."""

    fit: Fit
    rows: Rows
    reach: Sequence[Reach]
    base: Linearised

    @classmethod
    def of(cls, fit: Fit, pool: ThreadPoolExecutor | None) -> "_Seen":
        """Assume white noise: the missing part is not noise, and whitening it would remove most of a constant."""
        left = np.concatenate([r[one.used] for r, one in zip(fit.residuals, fit.run.series, strict=True)])
        noise = NoiseModel(np.empty(0), math.sqrt(float(np.mean(left**2))))
        fit = under(fit, noise, pool)
        rows = rows_of(fit.run.series, (), noise)
        reach = reach_of(fit, rows, pool)
        return cls(fit, rows, reach, following(linearised(fit, rows), rows, reach))

    def with_zeros(self) -> Linearised:
        """The linearised fit with a zero of each record but the first."""
        series = self.fit.run.series
        names = tuple(dict.fromkeys(record_of(one) for one in series))[1:]
        columns = tuple(
            tuple(np.full(one.blocks, float(record_of(one) == name)) for one in series) for name in names
        )
        return beside(self.fit, self.base, FreeFunction("zero", columns), self.rows, self.reach)

    def refitted(self, pool: ThreadPoolExecutor | None) -> Linearised | None:
        """The fit with a zero of each record, all parameters refitted; None where that fails.

        The refit is needed because an effect fitted without the zeros is far from its best values with them.
        """
        try:
            free = estimate(
                with_record_zero(self.fit.model),
                others_marked(self.fit.run.series),
                noise=self.rows.noise,
                pool=pool,
            )
            return following(linearised(free, self.rows), self.rows, reach_of(free, self.rows, pool))
        except InputError:
            return None


def _told(seen: _Seen, with_zeros: Linearised | None, most: float = math.inf) -> bool:
    """Whether zeros predict unseen data decisively better than the fit alone.

    The gain must have a practical size, and the error with the zeros must be at most `most`, as a share of the motion.
    """
    if with_zeros is None:
        return False
    found = predict([with_zeros, seen.base], seen.rows.blocks, seen.rows.record)
    size = seen.rows.size / seen.rows.noise.std  # converted to units of the noise, as the errors
    removed = found[1].mean_square - found[0].mean_square
    decided = weight_for(found[0], found[1]) > decisive(1) and removed > (PRACTICAL * size) ** 2
    return decided and found[0].mean_square < (most * size) ** 2


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
    alone = _Seen.of(fit, pool)
    if not _told(alone, alone.with_zeros()):
        return kept
    tell("the output's zero seems to differ from record to record; looking for an effect that says the same")
    known = catalogue.within(scales(series, fit.model))
    explained = _Seen.of(search(series, fit, given, known, pool, tell, most=1).fit, pool)
    if not _told(explained, explained.refitted(pool), FOLLOWS):
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
