"""Recorded numbers that are copies of the output, such as one sensor in volts and in millimetres: they are no
driving signals."""

from rhythmid.record.inventory import Recorded
from rhythmid.record.output_copy import correlation_of_copy, smallest_step
from rhythmid.start.direction import COPY
from rhythmid.start.relation import Follows, lead, together
from rhythmid.start.role_choice import Known

# standard errors of the lead, from six parts; a larger lead has a probability of 1 in 100 by chance
CLEARLY = 4.0


def copies_output(one: Recorded, output: Recorded) -> float:
    """Correlation with the output at equal times where the number is an affine copy of it; else 0."""
    _, first, second = together(one, output)
    return correlation_of_copy(first, second, (smallest_step(one.value), smallest_step(output.value)))


def is_second_sensor(one: Recorded, motion: Recorded, told: Follows) -> bool:
    """Whether a number is a second measurement of a motion that follows it as `told`, in any unit.

    It has the same sign and does not lead. A driving signal leads the motion, because damping takes part of it. A
    signal that lags in proportion is a filter's output. The force of a spring may coincide with the motion, too;
    then the size decides.
    """
    if told.correlation <= COPY or told.lag > 0.0:
        return False
    before, error = lead(one, motion)
    clear = abs(before) > CLEARLY * error
    return before < 0.0 if clear else told.is_copy


def note_of_sensor(one: Known) -> str:
    """Note on a number without a name that is a second measurement of a motion and is left out."""
    return f"{one.one} is taken for another sensor or a filter of that motion, which drives nothing: {one.meaning.reason}"


def note_of_copy(one: Recorded, correlation: float) -> str:
    """Note on a copy that is left out."""
    return (
        f"{one} is a copy of the output (correlation {correlation:+.5f} at once), in another unit or by another sensor: "
        "it drives nothing"
    )
