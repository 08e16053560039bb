"""One round of the search: scores of the whole catalogue at a fit, along whole records and in short windows."""

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rhythmid.diagnose.case import Untried
from rhythmid.diagnose.constants import PRACTICAL
from rhythmid.diagnose.free_functions import filtered
from rhythmid.diagnose.search.pair_scores import PairScore, pair_scores, thinned
from rhythmid.diagnose.search.score_tests import (
    Change,
    Score,
    Trajectories,
    best_changes,
    changes_of,
    p_value,
    score,
    sizes_along,
    trajectories,
    under,
)
from rhythmid.elements.candidates import candidates
from rhythmid.elements.catalogue import Catalogue
from rhythmid.elements.element import Element, Scales
from rhythmid.errors import InputError
from rhythmid.freed_memory import give_back
from rhythmid.identify.free_run import prepare_run
from rhythmid.identify.least_squares import column_norms, reduced
from rhythmid.identify.multiple_shooting import periods_long, windows
from rhythmid.identify.noise import NoiseModel, runs
from rhythmid.identify.output_error import Fit, coloured, minimise
from rhythmid.identify.record_scales import scales
from rhythmid.identify.series import Series

Array = NDArray[np.float64]
MISFIT = 0.1  # error, as a share of the motion, from which a residual with autocorrelation is not whitened
# windows in which the catalogue is scored: enough for all amplitudes, few enough to cost less than the records
WINDOWS = 40
MOST_REMOVED = 60  # number of guesses whose effects are removed from a residual before its noise is estimated
LEVEL = 0.01  # false-alarm rate of a round's score tests, over the whole catalogue
UNDERSTATED = 0.1  # smallest ratio of a score to the gain of the refit, far from the first guess
# frequency resolutions within which two frequencies count as equal: spectral lines closer than their width cannot be separated
OWN_LINE = 1.0
REMEMBERED = 4  # minimum length of a window, in correlation times of the noise


@dataclass(frozen=True)
class Round:
    """One round of the search.

    Parameters
    ----------
    scores : scores along the whole records, best first.
    p_value : probability of such a best score by chance.
    added : labels of the effects in the scored model.
    local : scores in short windows, best first. A score is linear in the missing effect. Along a whole record a missing force
        accumulates a phase error, which is nonlinear; in a short window this error stays small.
    pairs : scores of pairs of elements along the whole records, best first.
    """

    scores: tuple[Score, ...]
    p_value: float
    added: tuple[str, ...] = ()
    local: tuple[Score, ...] = ()
    pairs: tuple[PairScore, ...] = ()

    @property
    def chance(self) -> float:
        """Probability of such a best score by chance, along the whole records or in windows (Bonferroni).

        Each of the two tests is blind to some effects. A nonlinear response cancels along whole records and is taken for
        coloured noise there. A slow effect is hidden in windows.
        """
        return min(1.0, 2.0 * min(self.p_value, p_value(self.local)))

    @property
    def strongest(self) -> float:
        """The largest statistic of all scores; 0 without any."""
        return max((group[0].statistic for group in (self.scores, self.local) if group), default=0.0)


def could_pay(now: Round, fit: Fit, margin: float) -> bool:
    """Whether a further effect beside those of a fit could be accepted, if it has to gain this `margin` of the criterion.

    The best score of its round must be significant. It must also be of the order that an element has to gain and that an
    effect of practical size has, taking into account that a score can understate the gain of a refit.
    """
    series, noise = fit.run.series, fit.noise
    if now.chance >= LEVEL or fit.nrmse() ** 2 < UNDERSTATED * PRACTICAL**2:
        return False
    # number of samples times the mean square of the motion
    power = sum(one.power(one.used) for one in series)
    practical = PRACTICAL**2 * power / max(noise.variance, noise.long_run_variance)
    earned = 0.5 * (margin + math.log(max(fit.samples, 2)))
    return now.strongest > max(earned, UNDERSTATED * practical)


def distinct(scores: Sequence[Score], count: int) -> list[tuple[Score, list[Score]]]:
    """The best score of each of the first `count` elements, with all scores of that element."""
    found: dict[str, list[Score]] = {}
    for one in scores:
        if one.statistic <= 0.0:
            continue
        found.setdefault(one.element.name, []).append(one)
    return [(group[0], group) for group in list(found.values())[:count]]


def noise_without(fit: Fit, changes: Iterable[Change], filters: Iterable[tuple[Array, ...]]) -> NoiseModel:
    """Noise model of the residual after removing what the catalogue's best guesses and linear filters explain together.

    The residual of a model that lacks an effect is not noise. A regular motion can be predicted from its own past; it would be taken
    for coloured noise and whitened away. If nothing is missing, the guesses remove no more than their number of degrees of freedom,
    for which the variance is corrected. `filters` are changes of each series' block averages by linear dynamics that the
    catalogue may lack.
    """
    samples = sum(int(one.used.sum()) for one in fit.run.series)
    best = best_changes(fit, changes, min(MOST_REMOVED, samples // 50))
    residuals = [r.copy() for r in fit.residuals]
    share = 1.0
    picked = [*(one.outputs for one in best), *filters]
    if picked:
        used = [one.used for one in fit.run.series]
        design, target = reduced(
            (np.column_stack([c[i][u] for c in picked]), residuals[i][u]) for i, u in enumerate(used)
        )
        norms = column_norms(design)
        solution, _, rank, _ = np.linalg.lstsq(design / norms, -target, rcond=1e-6)
        solution = solution / norms
        share = samples / max(samples - int(rank), 1)
        for i, r in enumerate(residuals):
            r += np.column_stack([c[i] for c in picked]) @ solution
    stretches = [
        one.levelled(r[s], s) * math.sqrt(share)
        for r, one in zip(residuals, fit.run.series)
        for s in runs(one.used)
    ]
    return coloured(stretches, fit.run.series, fit.noise.std * 1e-6)


def one_round(
    fit: Fit, added: tuple[str, ...], catalogue: Catalogue, pool: ThreadPoolExecutor | None
) -> tuple[Round, Fit]:
    """Score the catalogue at a fit, under the noise left by its best guesses; also returns the fit under that noise.

    Otherwise a missing effect, such as a slow drift, would be taken for coloured noise, in later rounds as in the first.
    """
    noise = _noise_left(fit, catalogue, pool)
    if fit.nrmse() > MISFIT and noise.is_structure:
        noise = NoiseModel(np.empty(0), noise.variance**0.5)
    give_back()
    fit = under(fit, noise, pool)
    tested = sorted(thinned(fit, changes_at(fit, catalogue, pool)), key=lambda pair: -pair[0].statistic)
    local, sizes = scored_in_windows(fit, catalogue, pool), scales(fit.run.series, fit.model)
    tested = [pair for pair in tested if _separable(pair[0], sizes)]
    scores, pairs = [one for one, _ in tested], pair_scores(fit, tested)
    local = tuple(one for one in local if _separable(one, sizes))
    return Round(tuple(scores), p_value(scores), added, local, tuple(pairs)), fit


def _separable(one: Score, sizes: Scales) -> bool:
    """Whether a score is not of a vibration at the motion's own frequency.

    Such a vibration stands for any change in the path of the force. It explains much of whatever is missing, but is never a cause that the
    records show, and beside it the missing effect is hardly needed.
    """
    return own_frequency(one.element, one.values, sizes) >= OWN_LINE


def own_frequency(element: Element, values: Mapping[str, float], sizes: Scales) -> float:
    """Distance of a vibration, or of a resonance as narrow as a spectral line, from the forcing's harmonics, or of a free motion's frequencies.

    In frequency resolutions of the records; infinite for other effects. At a multiple of the forcing's frequency it is equivalent to any change in the
    path of the forcing, at that of a free motion to another damping or stiffness.
    """
    forcing, line = sizes.forcing_frequency, 1.0 / sizes.duration
    free = forcing <= 0.0 and sizes.idle
    if element.kernel is None or (forcing <= 0.0 and not free):
        return math.inf
    found = [values[one.name] for one in element.parameters if one.unit == "Hz"]
    damping = values[element.width] if element.width else 0.0
    low, high = min(sizes.frequency, sizes.swings[0] or math.inf), max(sizes.frequency, sizes.swings[1])
    apart = [
        max(low - f, f - high, 0.0) if free else abs(f - round(f / forcing) * forcing)
        for f in found
        if damping * f < line
    ]
    return min(apart, default=math.inf) / line


def changes_at(fit: Fit, catalogue: Catalogue, pool: ThreadPoolExecutor | None) -> Iterator[Change]:
    """Changes of the output by all first guesses of the catalogue, linearised at the fit."""
    return _changes_along(trajectories(fit), catalogue, pool)


def _changes_along(
    known: Trajectories, catalogue: Catalogue, pool: ThreadPoolExecutor | None
) -> Iterator[Change]:
    return changes_of(known, candidates(catalogue, known.fit.model.setting, sizes_along(known)).tried, pool)


def _noise_left(fit: Fit, catalogue: Catalogue, pool: ThreadPoolExecutor | None) -> NoiseModel:
    """Noise model of a fit's residual without what the catalogue and linear filters of velocity and actuator force explain."""
    known = trajectories(fit)
    filters = (columns for one in filtered(known, pool) for columns in one.columns)
    return noise_without(fit, _changes_along(known, catalogue, pool), filters)


def not_tried(nominal: Fit, catalogue: Catalogue, first: Round) -> list[Untried]:
    """Candidates of the catalogue that the first round could not score, each with the reason."""
    known = candidates(catalogue, nominal.model.setting, sizes_along(trajectories(nominal)))
    scored = {score.element.name for score in first.scores}
    lost = dict.fromkeys(element.name for element, _ in known.tried if element.name not in scored)
    reasons = dict(known.not_tried) | dict.fromkeys(
        lost, "from every first guess the model diverges or behaves as without the effect"
    )
    return [Untried(name, why) for name, why in reasons.items()]


def scored_in_windows(fit: Fit, catalogue: Catalogue, pool: ThreadPoolExecutor | None) -> list[Score]:
    """Scores of the catalogue in short windows of the records, with the model refitted there.

    Empty where the fit already uses such windows, or where the model diverges.
    """
    length = float(np.median([periods_long(one) for one in fit.run.series]))
    cut = windows(fit.run.series, length)
    if len(cut) < 2 * len(fit.run.series):
        return []
    cut = cut[:: math.ceil(len(cut) / WINDOWS)]
    try:
        run = prepare_run(fit.model, cut, fit.run.max_step)
        local = minimise(fit.model, run, fit.names, _within(fit.noise, cut), None, 10, pool)
        noise = _within(_noise_left(local, catalogue, pool), cut)
        local = under(local, noise, pool)
        return score(local, changes_at(local, catalogue, pool))
    except InputError:
        return []


def _within(noise: NoiseModel, cut: Sequence[Series]) -> NoiseModel:
    """The noise model for whitening short windows: white if its memory exceeds a quarter of a window."""
    if REMEMBERED * noise.order < min(one.blocks for one in cut):
        return noise
    return NoiseModel(np.empty(0), noise.variance**0.5)
