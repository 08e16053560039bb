"""The verdict: consistent, missing physics, unknown physics or undecided, and what cannot be told apart."""

import math
from collections.abc import Sequence

import numpy as np

from rhythmid.diagnose.answer.result import Verdict
from rhythmid.diagnose.line_test import strongest_line
from rhythmid.diagnose.location import Dependence
from rhythmid.diagnose.search.forward import LEVEL, MOST, WORTH, Search
from rhythmid.diagnose.static_law import sum_of_laws
from rhythmid.identify.noise import NoiseModel
from rhythmid.identify.series import Series, dominant_frequency, scales
from rhythmid.record.quality import resolution

TWINS = 2  # as many models that cannot be told apart are an answer; more are undecided
REMAINDER_LEVEL = 1e-6  # p-value of a structured remainder
LINE_SHARE = 0.05  # of the residual's power, from which a line in it is a matter
LINE_WORTH = 0.1  # of the power that the named effects explain, below which a line is their imperfection
# of the power that the named effects explain, beyond which a structured remainder says that they only imitate what is
# there: true effects of the concealed proof left 0.00005 at most, imitations 0.012 to 0.03, a real circuit (Silverbox) 0.002
LEFTOVER = 0.005
# of what the least of several named effects explains, beyond which a structured remainder says the same, unless it is no more
# than real machines leave of all that is explained: pairs of true effects of the concealed proof left none, imitations
# 0.15 and 1.2 of the least (0.0022 and 0.0044 of all); beside the corrections that a real circuit needs 0.0016 of all are left
RIVALLING, REAL = 0.1, 0.002
# of what was missing on held-out records, beyond which an explanation does not hold there: right names of the concealed
# proof left 0.015 at most, wrong ones 0.02 to 0.11
UNCARRIED = 0.02
CHANCE = 1e-3  # p-value of a last round from which its score is no chance
QUANTITIES = {
    "position": "position",
    "velocity": "velocity",
    "effort": "actuator's force",
    "signal": "signal",
}
PERIODS = 4  # of the dominant motion, below which a record says nothing


def significant(dependence: Dependence) -> bool:
    return dependence.p_value < REMAINDER_LEVEL and dependence.explained > 0.05


def verdict_of(
    found: Search,
    p_value: float,
    remains: Sequence[Dependence],
    twins: Sequence[tuple[str, ...]],
    repeats: NoiseModel | None,
    series: Sequence[Series],
    uncarried: float,
    imitating: Sequence[str] = (),
) -> tuple[Verdict, str]:
    """The verdict with its reason; `uncarried` is the share of what is missing on held-out records that `found` leaves, and
    `imitating` says which effects stand in for others."""
    fit = found.fit
    too_big = False
    if repeats is not None and repeats.variance > 0:
        residual = np.concatenate([r[one.used] for r, one in zip(fit.residuals, series)])
        rounding = max(resolution(one.value) for one in series) ** 2 / 12.0  # repeats with the motion
        ratio = float(np.mean(residual**2)) / (repeats.variance + rounding)
        colour = max(repeats.long_run_variance / repeats.variance, 1.0)
        too_big = ratio > 1.1 + 6.0 * math.sqrt(2.0 * colour / len(residual))
    line = strongest_line(fit)
    improvement = found.nominal.chi2 - fit.chi2
    explained = found.nominal.nrmse() ** 2 - fit.nrmse() ** 2
    if (
        line is not None
        and line.p_value < REMAINDER_LEVEL
        and line.share > LINE_SHARE
        and line.share * fit.nrmse() ** 2 > LINE_WORTH * explained
    ):
        return (
            "unknown_physics",
            f"a line at {line.frequency:.3g} Hz remains that nothing in the catalogue explains",
        )
    if not found.best.added:
        return _of_none(p_value, remains, too_big, series)
    leftover = max((d.gain for d in remains), default=0.0)
    if too_big or leftover > min(
        LEFTOVER * max(improvement, 1.0), max(REAL * improvement, RIVALLING * _least_worth(found))
    ):
        return "unknown_physics", "the best elements of the catalogue leave a structured remainder"
    if _more_to_say(found) > REAL * improvement:
        return "unknown_physics", "the best elements of the catalogue leave what further ones explain in part"
    if uncarried > UNCARRIED:
        return (
            "unknown_physics",
            f"with the best elements of the catalogue {100.0 * uncarried:.0f} % of what is missing on held-out data remains",
        )
    if imitating:
        return "unknown_physics", imitating[0]
    if len(found.best.added) >= MOST:
        return (
            "unknown_physics",
            f"{MOST} effects, as many as are tried together, are a series for something else",
        )
    return _of_names(found, twins, series)


def _of_none(
    p_value: float, remains: Sequence[Dependence], too_big: bool, series: Sequence[Series]
) -> tuple[Verdict, str]:
    """The verdict on records in which no effect is worth its parameters."""
    if (too_big and p_value < REMAINDER_LEVEL) or (
        remains and remains[0].explained > 0.2 and p_value < LEVEL
    ):
        return "unknown_physics", "no element of the catalogue explains what the nominal model leaves"
    if p_value < LEVEL:
        return "undecided", "something is there, but too faint for any element to be worth its parameters"
    if _weak(series):
        return "undecided", "the records are too short or too quiet to exclude anything of interest"
    return "consistent", ""


def _of_names(
    found: Search, twins: Sequence[tuple[str, ...]], series: Sequence[Series]
) -> tuple[Verdict, str]:
    """The verdict on effects that leave nothing, by whether the records determine each of them."""
    summed = sum_of_laws(found.best, found.trials, scales(series, found.best.model), WORTH)
    if summed is not None:
        terms = _words(found, summed.labels)
        law = f"one law of the {QUANTITIES[summed.quantity]}"
        if summed.series:
            return "unknown_physics", f"{terms} are needed at once, a series for {law}"
        return (
            "undecided",
            f"{terms} do it together, and {law} that the catalogue does not have would do it, too",
        )
    named = {found.best.element(label).name for label in found.best.added}
    if any(math.comb(len(group), len(named.intersection(group))) > TWINS for group in twins):
        return "undecided", "several effects explain the records equally well"
    return "missing_physics", ""


def _words(found: Search, labels: Sequence[str]) -> str:
    return " and ".join(found.best.element(label).name.replace("_", " ") for label in labels)


def _more_to_say(found: Search) -> float:
    """What further effects would gain: in the criterion, of a richer model that was tried and is worth its parameters; in
    chi2, of the best score of a round that began with all that was chosen, where that is no chance. 0 without."""
    best = found.best
    later = [one for one in found.rounds if set(one.added) >= set(best.added)]
    richer = min((t.bic() for t in found.trials if set(t.added) > set(best.added)), default=math.inf)
    gain = best.bic() - richer if best.bic() - richer > WORTH else 0.0
    return max([gain, *(one.scores[0].statistic for one in later if one.scores and one.p_value < CHANCE)])


def _least_worth(found: Search) -> float:
    """What the chosen model loses in chi2 without the least of its effects, as far as that was tried."""
    best = set(found.best.added)
    without = [t.chi2 for t in found.trials if set(t.added) < best and len(t.added) == len(best) - 1]
    return max(min(without, default=math.inf) - found.best.chi2, 1.0)


def _weak(series: Sequence[Series]) -> bool:
    """Records that hold fewer than a few periods of motion."""
    return sum((one.time[-1] - one.time[0]) * dominant_frequency(one) for one in series) < PERIODS
