"""Selection: from all hypotheses the one that an answer may stand by, and what is said against the others.

Effects are granted one place after the other. For each place all hypotheses with as many effects compete, whatever their
effects are, so that kin (friction laws, stiffness laws, lags) compete before they may stand together; the place is granted
where no row of the table of rejections speaks against the best of them.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from rhythmid.diagnose.constants import APART, MAINLY, MISMATCH, REST
from rhythmid.diagnose.evidence import weight_for
from rhythmid.diagnose.hypothesis import Hypothesis, Prediction
from rhythmid.diagnose.rejections import Claim, Rejection, decisive, rejections_of

SHAPE_RULES = ("within_bounds", "acts_within_records", "own_frequency")


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
    """

    hypotheses: tuple[Hypothesis, ...]
    maps: Mapping[str, Prediction]
    candidates: int
    size: float
    practical: float

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
        found = [one for one in self.hypotheses if len(one.elements) == count]
        return sorted(found, key=lambda one: (-one.prediction.score, one.key))

    def claim(self, hypothesis: Hypothesis, without: Hypothesis) -> Claim:
        """A hypothesis and what it has to be better than."""
        return Claim(
            hypothesis,
            without,
            self.nominal,
            self.floor,
            self.candidates,
            self.size,
            self.practical,
        )


@dataclass(frozen=True)
class Selection:
    """The chosen hypothesis, with the ones of each smaller number of effects that it grew from, the nominal model first; and
    all rejections."""

    chosen: Hypothesis
    grown: tuple[Hypothesis, ...]
    rejections: tuple[Rejection, ...]

    def sound(self, hypothesis: Hypothesis) -> bool:
        """Whether a hypothesis' effects have kept their shape, so that it is a rival at all."""
        return not any(
            row.hypothesis == hypothesis.elements and row.name in SHAPE_RULES for row in self.rejections
        )


def select(contest: Contest) -> Selection:
    """Grant effects their places. Hypotheses whose effects have lost their shape take no part.

    Where one effect alone is refused, two together may still be granted, if they predict better than the best one alone: of
    two that mask one another neither does much by itself.
    """
    told: list[Rejection] = []
    grown, smaller = [contest.nominal], contest.nominal
    most = max(len(one.elements) for one in contest.hypotheses)
    for count in range(1, most + 1):
        sound: list[Hypothesis] = []
        for one in contest.of_size(count):
            against = rejections_of(contest.claim(one, smaller))
            told += against
            if not any(row.name in SHAPE_RULES for row in against):
                sound.append(one)
        if not sound:
            continue
        close = [one for one in sound if one is sound[0] or equivalent(one, sound[0], contest)]
        refused = {row.hypothesis for row in told}
        granted = [one for one in close if one.elements not in refused]
        if granted:
            smaller = _simplest(granted)
            grown.append(smaller)
        else:
            # rounding decides nothing
            smaller = max(smaller, sound[0], key=lambda one: round(one.prediction.score, 6))
    return Selection(grown[-1], tuple(grown), tuple(told))


def _simplest(close: Sequence[Hypothesis]) -> Hypothesis:
    """Of hypotheses that predict about as well, one that no other is a special case of, with the fewest free parameters."""
    plain = [one for one in close if not any(special_case(other, one) for other in close)]
    return min(plain or close, key=lambda one: (one.free, -_basic(one), -one.prediction.score, one.key))


def _basic(one: Hypothesis) -> int:
    """How many richer laws contain the hypothesis' effects: the more, the more basic they are."""
    return sum(len(richer) for richer in one.richer.values())


def special_case(first: Hypothesis, second: Hypothesis) -> bool:
    """Whether the first is the second but for one effect, of which its own is a special case."""
    mine, other = set(first.names) - set(second.names), set(second.names) - set(first.names)
    return len(mine) == len(other) == 1 and other <= set(first.richer.get(next(iter(mine)), ()))


def equivalent(other: Hypothesis, best: Hypothesis, contest: Contest) -> bool:
    """Whether another hypothesis predicts as well as the better one: the data do not decide, or the better one is a richer law that
    does not replace it."""
    if special_case(other, best):
        whole = contest.nominal.prediction.mean_square - contest.floor
        return not replaces(best.prediction, other.prediction, contest.floor, whole)
    return weight_for(best.prediction, other.prediction) <= decisive(1)


def replaces(richer: Prediction, plain: Prediction, floor: float, whole: float) -> bool:
    """Whether a richer law is named in the place of one that it contains: it is told apart by far, and removes more than a small
    share of what the other leaves above the `floor` and of the `whole` mismatch, both mean squared errors. Or it is told apart, and
    the simpler one leaves most of the mismatch, which the richer one removes."""
    removed, left = plain.mean_square - richer.mean_square, plain.mean_square - floor
    weight = weight_for(richer, plain)
    if weight > APART:
        return removed >= max(REST * left, MISMATCH * whole)
    return weight > decisive(1) and left > MAINLY * whole and removed >= MAINLY * left
