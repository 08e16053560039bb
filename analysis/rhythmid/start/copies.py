"""Recorded numbers that are the output once more, such as one sensor in volts and in millimetres: they drive nothing."""

from rhythmid.record.inventory import Recorded
from rhythmid.record.output_copy import correlation_of_copy, smallest_step
from rhythmid.start.direction import COPY
from rhythmid.start.known import Known
from rhythmid.start.relation import Follows, lead, together

CLEARLY = (
    4.0  # standard errors, of six parts, by which one comes before or after another: by chance in 1 of 100
)


def copies_output(one: Recorded, output: Recorded) -> float:
    """Correlation with the output at the same time where the number is an affine copy of it; else 0."""
    _, first, second = together(one, output)
    return correlation_of_copy(first, second, (smallest_step(one.value), smallest_step(output.value)))


def is_second_sensor(one: Recorded, motion: Recorded, told: Follows) -> bool:
    """Whether a number shows a motion once more that would follow it as `told`, in whatever unit.

    It is of the same sign and comes no earlier. What drives a machine comes before the motion, because damping takes from it; what
    comes after it in proportion is a filter's output. At the same time the force of a spring may come, too; then the size tells.
    """
    if told.correlation <= COPY or told.lag > 0.0:
        return False
    before, error = lead(one, motion)
    clear = abs(before) > CLEARLY * error
    return before < 0.0 if clear else told.is_copy


def note_of_sensor(one: Known) -> str:
    """What to tell of a number without a name that shows a motion once more, and is left out."""
    return f"{one.one} is taken for another sensor or a filter of that motion, which drives nothing: {one.meaning.reason}"


def note_of_copy(one: Recorded, correlation: float) -> str:
    """What to tell of a copy that is left out."""
    return (
        f"{one} is a copy of the output (correlation {correlation:+.5f} at once), in another unit or by another sensor: "
        "it drives nothing"
    )
