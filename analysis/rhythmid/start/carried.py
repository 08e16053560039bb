"""A motion that drives another motion where there is no other driving signal, such as the tilt of a beam on which a
ball rolls."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from rhythmid.record.inventory import Recorded
from rhythmid.start.meaning import Meaning
from rhythmid.start.relation import SURE, follows, predicts
from rhythmid.start.rotary import rotary_of

ONE_WAY = 4.0  # ratio of evidence that is needed for one direction over the other
BEYOND_CHANCE = 3.0  # ratio to the largest evidence of shifted records
SHIFTS = 6  # parts of a record by which it is shifted
LEAST_CORRELATION = 0.3  # least correlation of driver and driven motion, at the lag of its maximum


@dataclass(frozen=True, eq=False)
class Carried:
    """The driven motion, its driver, and the strength of the evidence relative to chance, in both directions."""

    driven: Recorded
    driver: Recorded
    there: float
    back: float

    @property
    def reason(self) -> str:
        """Reason why it is the driven motion, as a phrase."""
        return f"{self.driver} drives it: its past predicts this one ({self.there:.3g} times as well as chance does; in the other direction {self.back:.2g} times)"

    @property
    def doubt(self) -> str:
        """Doubt about a motion that is taken for a force, as a phrase."""
        unit = self.driver.unit or "its unit"
        return (
            f"a motion, not a force: the model's forces are in {unit}, as if they were in proportion to it; "
            "a base that moves is kind: base_displacement"
        )


def carried_motion(known: Sequence[tuple[Recorded, Meaning]]) -> Carried | None:
    """The sliding motion that a rotating one drives, or the reverse, where no effort, command or base was recorded.

    Two motions of one kind may be joints of one robot whose plan moves one before the other, so they are not considered.
    """
    motions = [one for one, meaning in known if meaning.quantity == "position"]
    others = [
        meaning for _, meaning in known
        if meaning.quantity in (None, "effort") or meaning.commanded or meaning.forcing or meaning.base
    ]  # fmt: skip
    if others:
        return None
    turning = {id(one): rotary_of(one)[0] for one in motions}
    pairs = [
        (first, second) for first in motions for second in motions
        if turning[id(first)] is True and turning[id(second)] is False
    ]  # fmt: skip
    found: list[Carried] = []
    for first, second in pairs:
        there, back = predicts(first, second), predicts(second, first)
        if surely_drives(first, second, there, back):
            found.append(Carried(second, first, there, back))
        elif surely_drives(second, first, back, there):
            found.append(Carried(first, second, back, there))
    return max(found, key=lambda one: one.there, default=None)


def surely_drives(driver: Recorded, driven: Recorded, there: float, back: float) -> bool:
    """Whether the driver predicts the driven motion much better than the reverse, is correlated with it and
    earlier, and predicts it much better than its shifted record does.

    `there` and `back` are the results of `predicts`. Any two smooth motions help to predict each other, whatever
    their origin, and so do shifted ones.
    """
    if there < max(SURE, ONE_WAY * back):
        return False
    told = follows(driver, driven)
    if told.lag < 0.0 or abs(told.correlation) < LEAST_CORRELATION:
        return False
    count = len(driver.value)
    shifted = [np.roll(driver.value, part * count // SHIFTS) for part in range(1, SHIFTS)]
    chance = max(predicts(replace(driver, value=value), driven) for value in shifted)
    return there >= BEYOND_CHANCE * chance
