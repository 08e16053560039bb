"""Recorded numbers that are the output once more, such as one sensor in volts and in millimetres: they drive nothing."""

from rhythmid.record.inventory import Recorded
from rhythmid.record.output_copy import correlation_of_copy, smallest_step
from rhythmid.start.relation import together


def copies_output(one: Recorded, output: Recorded) -> float:
    """Correlation with the output at the same time where the number is an affine copy of it; else 0."""
    _, first, second = together(one, output)
    return correlation_of_copy(first, second, (smallest_step(one.value), smallest_step(output.value)))


def note_of_copy(one: Recorded, correlation: float) -> str:
    """What to tell of a copy that is left out."""
    return (
        f"{one} is a copy of the output (correlation {correlation:+.5f} at once), in another unit or by another sensor: "
        "it drives nothing"
    )
