"""Structures to refit after a round: the elements that score best, from their best guesses."""

import math
from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from rhythmid.diagnose.constants import EDGE, FOLLOWS
from rhythmid.diagnose.search.round import Round, changes_at, distinct
from rhythmid.diagnose.search.score_tests import Score, p_value, score
from rhythmid.diagnose.search.trial import Proposal, Trial, propose
from rhythmid.elements.catalogue import Catalogue
from rhythmid.errors import InputError
from rhythmid.identify.output_error import Fit, minimise, normalised_error
from rhythmid.identify.record_scales import scales
from rhythmid.identify.series import Series, record_of
from rhythmid.model import Model, Term

Array = NDArray[np.float64]
# number of elements refitted because of their scores along the whole records, and in windows. In 90 cases of all machines of the
# proof the right element, or a related law, was among the first four along the records or among the first three in windows
REFITTED, LOCAL = 4, 3
PAIRS = 3  # number of pairs that are refitted because of their scores
# difference of the information criterion below which two models are indistinguishable. A score is linear and a refit is not, so that
# of elements with such close statistics any may be the missing one
WORTH = 10.0
LEAST_LEVEL = 1e-6  # smallest level of a residual relative to the largest, against division by zero
SPRING = "linear_spring"
SHIFT = 1e-2  # share of the motion by which the position is shifted
# share of that shift's change of speed on a spring that holds the mass in the dominant motion, below which nothing restores it
HELD = 1e-3
STIFFNESSES = (1.0, 0.2, 0.05)  # first guesses, as shares of the inertia's own stiffness m ω²
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


def pair_proposals(here: Trial, now: Round, gained: float, known: str = "") -> list[Proposal]:
    """Structures to refit with two more elements, if by their joint score the criterion improves by more than what one has `gained`.

    With an element `known` also by more than with any pair with it: a next round would find those. Of pairs of the same two families the best one
    is taken, because related laws are compared later.
    """
    cost = math.log(max(here.samples, 2))
    promise = [(pair.statistic - cost * pair.free, pair) for pair in now.pairs]
    reached = max((gain for gain, pair in promise if known in pair.names), default=0.0)
    made: dict[tuple[str, ...], Proposal] = {}
    for gain, pair in sorted(promise, key=lambda one: -one[0]):
        if len(made) == PAIRS or gain <= max(gained, reached) + WORTH:
            break
        if pair.families not in made:
            first, second = pair.first, pair.second
            begun = propose(here.model, first.element, [first.start], now.added)
            starts, own = [second.start] * 2, [pair.own(here.model)]
            made[pair.families] = propose(begun.model, second.element, starts, begun.added, here.chi2, own)
    return list(made.values())


def in_parts(here: Trial, now: Round, found: Sequence[Trial]) -> Iterator[Proposal]:
    """The model with the parts of each law that was found at the end of its range in its place, from their sizes there.

    A law that is the sum of others within a range leaves their ratio beyond it. A friction that differs by direction is a friction and a
    constant force, while that force is the smaller one. Where it is the larger one the law ends where it acts in one direction only.
    Only laws of which the round has scored all parts: the others are in the model, or do the same as one of its parameters.
    """
    scored: dict[str, Score] = {}
    for one in now.scores:
        scored.setdefault(one.element.name, one)
    for trial in found:
        term = trial.model.term(trial.added[-1])
        if term is None or not _ends(term) or any(name not in scored for name in term.element.beyond):
            continue
        sizes = dict(term.element.moving_as(**term.numbers)) if term.element.moving_as else {}
        own = {name: trial.model.value(name) for name in here.model.free}
        model, added, made = here.model, now.added, None
        for name in term.element.beyond:
            made = propose(
                model, scored[name].element, [_guess(scored[name], term, sizes)], added, here.chi2, [own]
            )
            model, added = made.model, made.added
        if made is not None:
            yield made


def _guess(one: Score, term: Term, sizes: dict[str, float]) -> dict[str, float]:
    """A part's first guess: what it has in common with the law, as fitted, and its own size there."""
    element = one.element
    shared = {p.name: term.numbers[p.name] for p in element.parameters if p.name in term.numbers}
    size = {element.size: sizes[element.name]} if element.name in sizes else {}
    return {**one.start, **shared, **size}


def _ends(term: Term) -> bool:
    """Whether a parameter of a law that has parts is at one of the two ends of its range."""
    ranges = {p.name: p.bounds for p in term.element.parameters if all(map(math.isfinite, p.bounds))}
    return bool(term.element.beyond) and any(
        min(abs(term.numbers[name] - end) for end in ends) <= EDGE * (ends[1] - ends[0])
        for name, ends in ranges.items()
    )


def refitted(now: Round, least: int) -> int:
    """Number of elements of a round to refit: at least `least`, and all that score as well as the best."""
    best = distinct(now.scores, len(now.scores))
    return max(least, sum(one.statistic > best[0][0].statistic - WORTH for one, _ in best))


def from_given(
    nominal: Fit, given: Model, catalogue: Catalogue, chi2: float, pool: ThreadPoolExecutor | None
) -> list[Proposal]:
    """Structures to refit from the given values of the nominal model.

    Used where the refitted nominal model does not follow the machine in every record. The refit has then biased its parameters to
    compensate for the missing effect: the spring of a hopper that leaves the ground comes out far too soft and too long. Every
    record counts alike here: otherwise the one with the largest motion, to whose mismatch a score is least linear, would decide.
    """
    values = {name: given.value(name) for name in nominal.names if name in given.parameters}
    model = nominal.model.with_values(values)
    try:
        fit = minimise(model, nominal.run, nominal.names, nominal.noise, nominal.starts, 0, pool)
        run = replace(fit.run, series=levelled(fit))
        fit = minimise(model, run, nominal.names, nominal.noise, fit.starts, 0, pool)
        changes = changes_at(fit, catalogue, pool)
    except InputError:
        return []
    scores = score(fit, changes)
    return proposals(model, Round(tuple(scores), p_value(scores)), REFITTED, chi2)[0]


def restoring_force(fit: Fit, catalogue: Catalogue, added: tuple[str, ...]) -> Iterator[Proposal]:
    """The fitted model with a linear spring, if the catalogue holds one, nothing restores the position, and the motion comes back.

    No score test shows it there. A score is linear in the missing effect, along the motion of the model without it. A force that depends on
    the position decides whether that position wanders at all: along a run that wanders, even the sign of the score is arbitrary.
    `added` are the labels of the effects that the model has beyond the nominal one.
    """
    if SPRING not in catalogue or not fit.run.series:
        return
    sizes = scales(fit.run.series, fit.model)
    if not sizes.comes_back or is_restored(fit):
        return
    guesses = [{"stiffness": share * sizes.stiffness, "rest_length": sizes.centre} for share in STIFFNESSES]
    yield propose(fit.model, catalogue[SPRING], guesses, added, fit.chi2)


def is_restored(fit: Fit) -> bool:
    """Whether a shift of the position changes the speed of the fitted model along any of its series."""
    sizes = scales(fit.run.series, fit.model)
    shift = SHIFT * sizes.position
    usual = shift * (sizes.stiffness / sizes.mass) ** 0.5
    for index, start in enumerate(fit.starts):
        moved = start.copy()
        moved[0] += shift
        before, after = (fit.run.rows(fit.model, index, one) for one in (start, moved))
        if before is None or after is None:
            return True  # it is unstable: the score tests decide
        if float(np.abs(after[:, 1] - before[:, 1]).max()) > HELD * usual:
            return True
    return False


def follows_all(fit: Fit) -> bool:
    """Whether the model follows the machine in every record."""
    found = by_record(fit)
    errors = [normalised_error([left for left, _ in some], [one for _, one in some]) for some in found]
    return not any(error > FOLLOWS for error in errors)


def levelled(fit: Fit) -> tuple[Series, ...]:
    """The series of a fit with the size of each record's residual as the relative standard deviation of its noise."""
    level: dict[str, float] = {}
    for some in by_record(fit):
        squares = np.concatenate([one.levelled(residual)[one.used] ** 2 for residual, one in some])
        level |= dict.fromkeys((one.name for _, one in some), math.sqrt(float(np.mean(squares))))
    top = max(level.values())
    return tuple(
        replace(one, spread=one.spread_of(slice(None)) * max(level[one.name] / top, LEAST_LEVEL))
        for one in fit.run.series
    )


def by_record(fit: Fit) -> list[list[tuple[Array, Series]]]:
    """Residuals and series of a fit, grouped by the record from which they are."""
    found: dict[str, list[tuple[Array, Series]]] = {}
    for residual, one in zip(fit.residuals, fit.run.series):
        found.setdefault(record_of(one), []).append((residual, one))
    return list(found.values())


def better_of(trials: Sequence[Trial]) -> list[Trial]:
    """The best trial of each structure, best first."""
    kept: dict[tuple[str, ...], Trial] = {}
    for trial in sorted(trials, key=lambda t: t.bic()):
        kept.setdefault(trial.added, trial)
    return list(kept.values())
