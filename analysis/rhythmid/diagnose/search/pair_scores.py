"""Score tests of pairs: which two laws together would explain the residual, where each alone does not.

A free parameter of the model may fit the mean of two missing laws. A damper, for example, fits dry friction and quadratic drag; what is
left are the parts by which these differ from a damper, and they have opposite signs. Each law alone then has the wrong sign
or gains nothing. The joint score statistic of two changes of the free run, from which the parts of the model's own parameters are projected
out, shows the pair (C. R. Rao, Math. Proc. Camb. Phil. Soc. 44 (1948) 50). It needs only the scalar products of the changes.
"""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from rhythmid.diagnose.search.score_tests import Change, Score, scored, unexplained
from rhythmid.elements.first_guess import LARGEST_FACTOR
from rhythmid.identify.output_error import Fit
from rhythmid.model import Model

Array = NDArray[np.float64]
# share of a change (its square) that must remain beside the other one: with less, both sizes are differences of large numbers
APART = 1e-3
# number of rows of which scores of pairs are computed at most. They only propose, and take the products of any two of a hundred changes
MOST_ROWS = 20_000


@dataclass(frozen=True)
class PairScore:
    """How well the best guesses of two elements explain the residual together; each `size` is the one beside the other."""

    first: Score
    second: Score
    statistic: float

    @property
    def names(self) -> tuple[str, str]:
        """Names of the two elements."""
        return self.first.element.name, self.second.element.name

    @property
    def families(self) -> tuple[str, ...]:
        """Families of the two elements in alphabetical order; the name of an element without one."""
        both = self.first.element, self.second.element
        return tuple(sorted(one.family or one.name for one in both))

    @property
    def free(self) -> int:
        """Number of free parameters of the two elements."""
        both = self.first.element, self.second.element
        return sum(not parameter.fixed for one in both for parameter in one.parameters)

    def own(self, model: Model) -> dict[str, float]:
        """Values of the model's own parameters beside both first guesses, within their bounds."""
        once = self.first.own(model)
        return once | self.second.own(model.with_values(once))


def thinned(fit: Fit, changes: Iterable[Change]) -> Iterator[tuple[Score, Array]]:
    """Scores of all changes, each with at most `MOST_ROWS` rows of what the model's parameters cannot reproduce of it."""
    every = _every(fit)
    return ((one, left[::every].copy()) for one, _, left in scored(fit, changes))


def pair_scores(fit: Fit, tested: Sequence[tuple[Score, Array]]) -> list[PairScore]:
    """The best guesses of each pair of elements, best pair first; `tested` are single guesses as `thinned` gives them."""
    if len(tested) < 2:
        return []
    scores, every = [one for one, _ in tested], _every(fit)
    columns = np.stack([column for _, column in tested])
    norms = np.maximum(np.linalg.norm(columns, axis=1), np.finfo(float).tiny)
    columns /= norms[:, None]
    along, cosine = -columns @ unexplained(fit)[::every], columns @ columns.T
    apart = np.maximum(1.0 - cosine**2, np.finfo(float).eps)
    size = (along[:, None] - cosine * along) / apart  # of the row's change beside the column's
    factor = size / norms[:, None]
    gain = size * along[:, None]
    gain = np.where(
        (apart < APART) | (refused := _refused(scores, factor)) | refused.T, 0.0, every * (gain + gain.T)
    )
    places: dict[str, list[int]] = {}
    for index, one in enumerate(scores):
        places.setdefault(one.element.name, []).append(index)
    found = []
    for rows, others in combinations(places.values(), 2):
        part = gain[np.ix_(rows, others)]
        row, other = np.unravel_index(int(np.argmax(part)), part.shape)
        i, j = rows[row], others[other]
        first, second = replace(scores[i], size=factor[i, j]), replace(scores[j], size=factor[j, i])
        found.append(PairScore(first, second, gain[i, j]))
    return sorted((one for one in found if one.statistic > 0.0), key=lambda one: -one.statistic)


def _every(fit: Fit) -> int:
    """Number of rows of which one is kept."""
    return -(-len(fit.linearisation.residual) // MOST_ROWS)


def _refused(scores: Sequence[Score], factor: Array) -> NDArray[np.bool_]:
    """Where a factor (m, m) on the row's guess has an impossible sign, or is an extrapolation."""
    signs = np.array([[one.element.forbids(one.values, sign) for sign in (-1.0, 1.0)] for one in scores])
    return np.where(factor < 0.0, signs[:, :1], signs[:, 1:]) | (np.abs(factor) > LARGEST_FACTOR)
