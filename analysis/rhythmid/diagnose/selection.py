"""Selection: from all hypotheses the one that an answer may stand by, and what is said against the others.

Effects are granted one place after the other. For each place all hypotheses with as many effects compete, whatever their
effects are, so that kin (friction laws, stiffness laws, lags) compete before they may stand together; the place is granted
where no row of the table of rejections speaks against the best of them.
"""

import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace

from rhythmid.diagnose.constants import EQUIVALENT, RICHER
from rhythmid.diagnose.evidence import removed, weight_for
from rhythmid.diagnose.hypothesis import Hypothesis, Prediction, special_case
from rhythmid.diagnose.rejections import (
    OVER_CONTAINED,
    OVER_SIMPLER,
    Claim,
    Rejection,
    decisive,
    keeps_shape,
    rejections_of,
    replaces,
)


@dataclass(frozen=True)
class Contest:
    """All hypotheses of a case.

    Parameters
    ----------
    hypotheses : the nominal model first; effects, freed values, delays and other locations.
    maps : free maps, by the quantity that they depend on.
    candidates : number of effects that were looked at for each place.
    size : rms of what errors are a share of.
    practical : share of it below which an effect is of no practical matter.
    ruled_out : hypotheses that the search has set aside because of their shape. They are rejected like others, and what they
        predict is no measure for anything.
    follows : error on held-out data, as a share of `size`, up to which a model follows the machine; infinite for an effort, whose noise
        may be as large.
    cut_short : whether the budget ended the search before all effects that scored well were tried.
    structured : share of the error of the nominal model that follows from its own past, so that it is no noise; 0 of an effort, whose noise
        the filter of the balance colours.
    structured_after : the same of the model with which the search ended; of an effort that of the chosen one, what lasts longer than the
        filter mixes neighbours.
    """

    hypotheses: tuple[Hypothesis, ...]
    maps: Mapping[str, Prediction]
    candidates: int
    size: float
    practical: float
    ruled_out: tuple[Hypothesis, ...] = ()
    follows: float = math.inf
    cut_short: bool = False
    structured: float = 0.0
    structured_after: float = 0.0

    @property
    def nominal(self) -> Hypothesis:
        """The refitted nominal model."""
        return next(one for one in self.hypotheses if one.kind == "nominal")

    @property
    def floor(self) -> float:
        """Mean squared error of the best prediction of all."""
        every = [one.prediction for one in self.hypotheses]
        return min(one.mean_square for one in (*every, *self.maps.values()))

    def of_size(self, count: int) -> list[Hypothesis]:
        """Hypotheses with so many effects, the one that predicts best first."""
        found = [one for one in (*self.hypotheses, *self.ruled_out) if len(one.elements) == count]
        return sorted(found, key=lambda one: (-one.prediction.score, one.key))

    def claim(self, hypothesis: Hypothesis, without: Hypothesis, simpler: Hypothesis | None = None) -> Claim:
        """A hypothesis and what it has to be better than."""
        return Claim(
            hypothesis,
            without,
            self.nominal,
            self.floor,
            self.candidates,
            self.size,
            self.practical,
            simpler,
        )


@dataclass(frozen=True)
class Selection:
    """The chosen hypothesis, and all rejections."""

    chosen: Hypothesis
    rejections: tuple[Rejection, ...]


def select(contest: Contest) -> Selection:
    """Grant effects their places. Hypotheses whose effects have lost their shape take no part.

    Where one effect alone is refused, two together may still be granted, if they predict better than the best one alone: of
    two that mask one another neither does much by itself.
    """
    told: list[Rejection] = []
    chosen = smaller = contest.nominal
    most = max(len(one.elements) for one in (*contest.hypotheses, *contest.ruled_out))
    for count in range(1, most + 1):
        sound: list[Hypothesis] = []
        for one in contest.of_size(count):
            told += rejections_of(contest.claim(one, smaller))
            if keeps_shape(one.shape):
                sound.append(one)
        if not sound:
            continue
        close = [one for one in sound if one is sound[0] or equivalent(one, sound[0], contest)]
        refused = {row.hypothesis for row in told}
        granted = [one for one in close if one.elements not in refused]
        if granted:
            chosen = smaller = _simplest(granted)
            told += _beaten(smaller, granted, contest)
        else:
            # rounding decides nothing
            smaller = max(smaller, sound[0], key=lambda one: round(one.prediction.score, 6))
    chosen = _beside_others(chosen, contest, {row.hypothesis for row in told})
    return Selection(chosen, tuple(told))


def _beside_others(chosen: Hypothesis, contest: Contest, refused: Collection[tuple[str, ...]]) -> Hypothesis:
    """The chosen hypothesis, or the kin of it that is decisively better where both have the same further effects."""
    sound = [one for one in contest.hypotheses if keeps_shape(one.shape)]
    rivals = [(one, beside_small_effects(one, chosen, sound)) for one in sound if one.elements not in refused]
    weights = [
        (weight_for(compared.prediction, chosen.prediction), one)
        for one, compared in rivals
        if compared is not one
    ]
    weight, best = max(weights, key=lambda pair: pair[0], default=(0.0, chosen))
    return best if weight > decisive(1) else chosen


def beside_small_effects(rival: Hypothesis, chosen: Hypothesis, sound: Sequence[Hypothesis]) -> Hypothesis:
    """A rival that predicts as much better than the chosen hypothesis as it does where both have the same further effects.

    Of laws of one family the wrong one may do better alone: it takes on a part of small effects that are too small to be named. The
    further effects are those with which either of the two predicts best, among the `sound` hypotheses. Without any the rival is as it
    is, and so is one that is no kin, or whose law contains the other one's.
    """
    kin = sorted(rival.family.values()) == sorted(chosen.family.values())
    if rival is chosen or not kin or special_case(rival, chosen) or special_case(chosen, rival):
        return rival
    pairs = [
        (one, other)
        for one, beside in _further(rival, sound)
        for other, same in _further(chosen, sound)
        if beside == same
    ]
    if not pairs:
        return rival
    one, other = max(pairs, key=lambda pair: max(each.prediction.score for each in pair))
    density = chosen.prediction.log_density + one.prediction.log_density - other.prediction.log_density
    return replace(rival, prediction=replace(rival.prediction, log_density=density))


def _further(one: Hypothesis, sound: Sequence[Hypothesis]) -> list[tuple[Hypothesis, frozenset[str]]]:
    """Hypotheses that predict better than this one with more effects, with those that they have beside it."""
    own = set(one.elements)
    return [
        (more, frozenset(more.elements) - own)
        for more in sound
        if more.kind == "effects"
        and own < set(more.elements)
        and more.prediction.score > one.prediction.score
    ]


def _simplest(close: Sequence[Hypothesis]) -> Hypothesis:
    """Of hypotheses that predict about as well, one that no other is a special case of, with the fewest free parameters."""
    plain = [one for one in close if not any(special_case(other, one) for other in close)]
    return min(plain or close, key=lambda one: (one.free, -_basic(one), -one.prediction.score, one.key))


def _beaten(chosen: Hypothesis, granted: Sequence[Hypothesis], contest: Contest) -> list[Rejection]:
    """What is said against hypotheses in whose place a simpler one is chosen, which predicts about as well."""
    found: list[Rejection] = []
    for one in granted:
        if special_case(chosen, one):
            found += rejections_of(contest.claim(one, chosen, chosen), OVER_CONTAINED)
        elif chosen.free < one.free:
            found += rejections_of(contest.claim(one, chosen, chosen), OVER_SIMPLER)
    return found


def _basic(one: Hypothesis) -> int:
    """How many richer laws contain the hypothesis' effects: the more, the more basic they are."""
    return sum(len(richer) for richer in one.richer.values())


def equivalent(other: Hypothesis, best: Hypothesis, contest: Contest) -> bool:
    """Whether another hypothesis predicts as well as the better one: the data do not decide, or the better one is a richer law that
    does not replace it.

    What leaves more of the mismatch than a law may that stands for a richer one does not, although it predicts more blocks better: an end
    stop acts in few of them.
    """
    if special_case(other, best):
        return not replaces(contest.claim(best, other, other))
    less, uncertain = removed(best.prediction, other.prediction)
    whole = contest.nominal.prediction.mean_square - contest.floor
    if less - EQUIVALENT * uncertain > RICHER * whole:
        return False
    return weight_for(best.prediction, other.prediction) <= decisive(1)
