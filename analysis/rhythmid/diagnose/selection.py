"""Selection: choose the hypothesis on which an answer is based, and collect the rejections of the others.

Effects are accepted one place after the other. For each place all hypotheses with as many effects compete, whatever their effects
are. Related laws (friction laws, stiffness laws, lags) therefore compete before they may stand together. An effect is accepted
where no rule of the table of rejections rejects the best of them.
"""

import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass

from rhythmid.diagnose.constants import EQUIVALENT, RICHER
from rhythmid.diagnose.evidence import removed, weight_for
from rhythmid.diagnose.hypothesis import Hypothesis, Prediction, special_case
from rhythmid.diagnose.rejections import (
    AT_END,
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
    maps : predictions of free maps, by the quantity that they depend on.
    candidates : number of effects tried for each place.
    size : rms of the signal that errors are a share of.
    practical : share of it below which an effect has no practical importance.
    unnamed : share of it below which a remainder that no effect explains has none.
    ruled_out : hypotheses that the search has discarded because of their shape. They are rejected like others, and their
        predictions are not used for comparison.
    follows : error on held-out data, as a share of `size`, up to which a model follows the machine; infinite for an effort, whose
        noise may be as large.
    cut_short : whether the budget ended the search before all effects that scored well were tried.
    uncompared : whether the budget ended before the other kinds of explanation, and laws related to the chosen ones, were compared.
    structured : share of the nominal model's error that is predictable from its own past, hence not noise; 0 for an effort,
        whose noise is coloured by the filter of the balance.
    structured_after : the same for the model with which the search ended; for an effort, the share of the chosen model's error
        that lasts longer than the filter mixes neighbours.
    """

    hypotheses: tuple[Hypothesis, ...]
    maps: Mapping[str, Prediction]
    candidates: int
    size: float
    practical: float
    unnamed: float
    ruled_out: tuple[Hypothesis, ...] = ()
    follows: float = math.inf
    cut_short: bool = False
    structured: float = 0.0
    structured_after: float = 0.0
    uncompared: bool = False

    @property
    def nominal(self) -> Hypothesis:
        """The refitted nominal model."""
        return next(one for one in self.hypotheses if one.kind == "nominal")

    @property
    def floor(self) -> float:
        """Mean squared error of the best prediction of all."""
        every = [one.prediction for one in self.hypotheses]
        return min(one.mean_square for one in (*every, *self.maps.values()))

    @property
    def mismatch(self) -> float:
        """Explainable mismatch: mean squared error that the best prediction of all removes from that of the nominal model."""
        return self.nominal.prediction.mean_square - self.floor

    def of_size(self, count: int) -> list[Hypothesis]:
        """Hypotheses with this number of effects, the best prediction first."""
        found = [one for one in (*self.hypotheses, *self.ruled_out) if len(one.elements) == count]
        return sorted(found, key=lambda one: (-one.prediction.score, one.key))

    def claim(self, hypothesis: Hypothesis, without: Hypothesis, simpler: Hypothesis | None = None) -> Claim:
        """A hypothesis together with those with which it is compared."""
        return Claim(
            hypothesis, without, self.nominal, self.floor, self.candidates, self.size, self.practical, simpler
        )


@dataclass(frozen=True)
class Selection:
    """The chosen hypothesis, and all rejections."""

    chosen: Hypothesis
    rejections: tuple[Rejection, ...]


def select(contest: Contest) -> Selection:
    """Accept effects one by one. Hypotheses whose effects do not keep their shape do not compete.

    Where a single effect is rejected, two together may still be accepted if they predict better than the best single one: two
    effects that mask one another contribute little separately.
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
        granted = _granted(sound, {row.hypothesis for row in told}, contest)
        if granted:
            chosen = smaller = _simplest(granted)
            told += _beaten(smaller, granted, contest)
        else:
            # a difference of rounding must not decide
            smaller = max(smaller, sound[0], key=lambda one: round(one.prediction.score, 6))
    return Selection(_in_parts(chosen, contest, told), tuple(told))


def _granted(
    sound: Sequence[Hypothesis], refused: Collection[tuple[str, ...]], contest: Contest
) -> list[Hypothesis]:
    """Hypotheses that are not refused and predict as well as the best of `sound`, which are sorted by prediction.

    The best itself may be refused in favour of a simpler law. If another hypothesis predicts better than the simplest of those found, it is
    not one of them, and they give way to it.
    """
    close = [one for one in sound if one is sound[0] or equivalent(one, sound[0], contest)]
    granted = [one for one in close if one.elements not in refused]
    if not granted:
        return []
    simplest = _simplest(granted)
    ahead = [
        one
        for one in sound
        if one.elements not in refused
        and one.prediction.score > simplest.prediction.score
        and not equivalent(simplest, one, contest)
    ]
    return _granted(ahead, refused, contest) if ahead else granted


def _in_parts(chosen: Hypothesis, contest: Contest, told: Sequence[Rejection]) -> Hypothesis:
    """The chosen hypothesis, or one with the parts of a law that predicts decisively better at the end of its range.

    There the law is the sum of others: a friction that acts in one direction only is a constant force and a friction. Its name does not apply,
    but its evidence is for the parts, which have as many parameters.
    """
    best = chosen
    for law in contest.ruled_out:
        against = {row.name for row in told if row.hypothesis == law.elements}
        better = weight_for(law.prediction, best.prediction) > decisive(1)
        if against != {AT_END} or not better or len(law.elements) > max(len(chosen.elements), 1):
            continue
        for name, parts in law.beyond.items():
            names = sorted([*(one for one in law.names if one != name), *parts])
            found = [
                one for one in contest.hypotheses if sorted(one.names) == names and keeps_shape(one.shape)
            ]
            best = max([best, *found], key=lambda one: one.prediction.score)
    return best


def _simplest(close: Sequence[Hypothesis]) -> Hypothesis:
    """The hypothesis with the fewest free parameters among equally good ones of which no other one is a special case."""
    plain = [one for one in close if not any(special_case(other, one) for other in close)]
    return min(plain or close, key=lambda one: (one.free, -_basic(one), -one.prediction.score, one.key))


def _beaten(chosen: Hypothesis, granted: Sequence[Hypothesis], contest: Contest) -> list[Rejection]:
    """Rejections of hypotheses for which a simpler one with about the same prediction is chosen."""
    found: list[Rejection] = []
    for one in granted:
        if special_case(chosen, one):
            found += rejections_of(contest.claim(one, chosen, chosen), OVER_CONTAINED)
        elif chosen.free < one.free:
            found += rejections_of(contest.claim(one, chosen, chosen), OVER_SIMPLER)
    return found


def _basic(one: Hypothesis) -> int:
    """Number of richer laws that contain the hypothesis' effects: the larger, the more basic they are."""
    return sum(len(richer) for richer in one.richer.values())


def equivalent(other: Hypothesis, best: Hypothesis, contest: Contest) -> bool:
    """Whether another hypothesis predicts as well as the better one.

    The data do not separate them, or the better one is a richer law that does not replace the other. The other is not equivalent
    if it leaves significantly more of the mismatch than a simpler law may, even if it predicts more blocks better: an end
    stop, for example, acts in few blocks.
    """
    if special_case(other, best):
        return not replaces(contest.claim(best, other, other))
    less, uncertain = removed(best.prediction, other.prediction)
    if less - EQUIVALENT * uncertain > RICHER * contest.mismatch:
        return False
    return weight_for(best.prediction, other.prediction) <= decisive(1)
