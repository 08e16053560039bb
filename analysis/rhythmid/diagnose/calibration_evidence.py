"""Evidence for a calibration of the measurement: whether it predicts data that the fit has not seen decisively better.

A calibration is no missing physics, but physics can imitate it. It is therefore compared both beside the nominal model and beside
an effect of the catalogue. The output is linear in it, so that beside the nominal model first-order cross-validation is exact. Beside
an effect all parameters are fitted together, because an effect that was fitted without the calibration is far from its best values.
"""

import math
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

from rhythmid.diagnose.constants import PRACTICAL, REST
from rhythmid.diagnose.contenders import Rows, linearised, rows_of
from rhythmid.diagnose.evidence import Linearised, predict, weight_for
from rhythmid.diagnose.free_functions import FreeFunction
from rhythmid.diagnose.location import Reach, beside, following, reach_of
from rhythmid.diagnose.rejections import decisive
from rhythmid.diagnose.search.forward import search
from rhythmid.diagnose.search.score_tests import under
from rhythmid.elements.catalogue import Catalogue
from rhythmid.errors import InputError
from rhythmid.identify.output_error import Fit, estimate
from rhythmid.identify.record_scales import scales
from rhythmid.identify.series import Series
from rhythmid.model import Model
from rhythmid.progress import Tell


@dataclass(frozen=True)
class Seen:
    """A fit under white noise, with the data for its predictions."""

    fit: Fit
    rows: Rows
    reach: Sequence[Reach]
    base: Linearised

    @classmethod
    def of(cls, fit: Fit, pool: ThreadPoolExecutor | None) -> "Seen":
        """Assume white noise: the missing part is not noise, and whitening it would remove most of a constant."""
        fit = under(fit, fit.white, pool)
        rows = rows_of(fit.run.series, (), fit.noise)
        reach = reach_of(fit, rows, pool)
        return cls(fit, rows, reach, following(linearised(fit, rows), rows, reach))

    @classmethod
    def explained(
        cls, fit: Fit, given: Model, catalogue: Catalogue, pool: ThreadPoolExecutor | None, tell: Tell
    ) -> "Seen":
        """The fit of the model `given`, with the effect of the catalogue that explains the records best."""
        series = fit.run.series
        known = catalogue.within(scales(series, fit.model))
        return cls.of(search(series, fit, given, known, pool, tell, most=1).fit, pool)

    def extended(self, by: FreeFunction) -> Linearised:
        """The linearised fit with signals added to its output, each with a free coefficient."""
        return beside(self.fit, self.base, by, self.rows, self.reach)

    def refitted(
        self, model: Model, series: Sequence[Series], pool: ThreadPoolExecutor | None
    ) -> Linearised | None:
        """The fit of a model that contains the calibration; None where it fails."""
        try:
            free = estimate(model, series, noise=self.rows.noise, pool=pool)
            return following(linearised(free, self.rows), self.rows, reach_of(free, self.rows, pool))
        except InputError:
            return None

    def replaces(self, one: Linearised | None, other: Linearised | None) -> bool:
        """Whether a fit predicts unseen data decisively better than another, and removes at least `REST` of what that one leaves."""
        if one is None or other is None:
            return one is not None
        first, second = predict([one, other], self.rows.blocks, self.rows.record)
        return (
            weight_for(first, second) > decisive(1) and first.mean_square < (1.0 - REST) * second.mean_square
        )

    def needs(self, with_it: Linearised | None, without: Linearised | None, most: float = math.inf) -> bool:
        """Whether the calibration by which two fits differ predicts unseen data decisively better.

        The gain must have a practical size, and the error with the calibration must be at most `most`, as a share of the motion.
        """
        if with_it is None or without is None:
            return False
        found = predict([with_it, without], self.rows.blocks, self.rows.record)
        size = self.rows.size / self.rows.noise.std  # converted to units of the noise, as the errors
        removed = found[1].mean_square - found[0].mean_square
        decided = weight_for(found[0], found[1]) > decisive(1) and removed > (PRACTICAL * size) ** 2
        return decided and found[0].mean_square < (most * size) ** 2
