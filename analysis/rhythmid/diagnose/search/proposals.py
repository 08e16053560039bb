"""Structures to refit after a round: the elements that score best, from their best guesses."""

import math
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor

from rhythmid.diagnose.search.round import Round, changes_at, distinct
from rhythmid.diagnose.search.score_tests import p_value, score
from rhythmid.diagnose.search.trial import Proposal, Trial, propose
from rhythmid.elements.catalogue import Catalogue
from rhythmid.errors import InputError
from rhythmid.identify.output_error import Fit, minimise
from rhythmid.model import Model

# number of elements refitted because of their scores along the whole records, and in windows. In 90 cases of all machines of the
# proof the right element, or a related law, was among the first four along the records or among the first three in windows
REFITTED, LOCAL = 4, 3
# difference of the information criterion below which two models are indistinguishable. A score is linear and a refit is not, so that
# of elements with such close statistics any may be the missing one
WORTH = 10.0
MANY = 5  # guesses of one element from which more of them are tried, because its shape matters


def proposals(
    base: Model, now: Round, count: int, chi2: float, first: int = 0
) -> tuple[list[Proposal], list[float]]:
    """Structures to refit, and for each the chi2 below which no further start is tried.

    They are the elements that score best along the whole records, from the `first` on; together with the first ones also
    those that score best in windows.
    """
    made, enough = [], []
    local = {best.element.name: group for best, group in distinct(now.local, LOCAL if first == 0 else 0)}
    for best, group in distinct(now.scores, first + count)[first:]:
        starts = [(one.start, one.own(base)) for one in group[: 3 if len(group) > MANY else 2]]
        if not 0.2 < abs(best.size) < 5.0:  # the size is an extrapolation far from the guess that was scored
            starts.insert(1, (dict(best.values), best.own(base, 1.0)))
        starts = [*[(one.start, {}) for one in local.pop(best.element.name, [])[:1]], *starts][:3]
        values, beside = zip(*starts)
        made.append(propose(base, best.element, values, now.added, chi2, beside))
        enough.append(chi2 - 0.8 * best.statistic)
    for group in local.values():
        made.append(propose(base, group[0].element, [one.start for one in group[:2]], now.added, chi2))
        enough.append(-math.inf)
    return made, enough


def refitted(now: Round, least: int) -> int:
    """Number of elements of a round to refit: at least `least`, and all that score as well as the best."""
    best = distinct(now.scores, len(now.scores))
    return max(least, sum(one.statistic > best[0][0].statistic - WORTH for one, _ in best))


def from_given(
    nominal: Fit, given: Model, catalogue: Catalogue, chi2: float, pool: ThreadPoolExecutor | None
) -> list[Proposal]:
    """Structures to refit from the given values of the nominal model.

    Used where the refitted nominal model does not follow the machine. The refit has then biased its parameters to compensate for
    the missing effect: the spring of a hopper that leaves the ground comes out far too soft and too long.
    """
    values = {name: given.value(name) for name in nominal.names if name in given.parameters}
    model = nominal.model.with_values(values)
    try:
        fit = minimise(model, nominal.run, nominal.names, nominal.noise, nominal.starts, 0, pool)
        changes = changes_at(fit, catalogue, pool)
    except InputError:
        return []
    scores = score(fit, changes)
    return proposals(model, Round(tuple(scores), p_value(scores)), REFITTED, chi2)[0]


def better_of(trials: Sequence[Trial]) -> list[Trial]:
    """The best trial of each structure, best first."""
    kept: dict[tuple[str, ...], Trial] = {}
    for trial in sorted(trials, key=lambda t: t.bic()):
        kept.setdefault(trial.added, trial)
    return list(kept.values())
