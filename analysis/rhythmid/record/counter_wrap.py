"""Times that a counter of so many bits has told, which begins again at zero: micros() of a small controller does after 71.6 minutes."""

from typing import Any

import numpy as np

# of the counts, and of counts of µs that are written in ms or s
SPANS = (2.0**16, 2.0**32, 2.0**32 * 1e-3, 2.0**32 * 1e-6)
LONGEST_STEP_OVER_END = 3.0  # usual steps that the one over the end may be, a lost sample among them


def unwrapped(values: Any) -> Any:
    """A column with what has been counted before each new beginning added; the same where no counter has begun anew.

    A step back is the end of a counter where it falls short of the counter's span by as much as some steps forward.
    """
    time = np.asarray(values)
    if time.dtype.kind not in "fiu" or time.ndim != 1 or len(time) < 3:
        return values
    time = time.astype(np.float64)
    step = np.diff(time)
    back = step < 0.0
    if not back.any() or not (step > 0.0).any():
        return values
    usual = float(np.median(step[step > 0.0]))
    for span in SPANS:
        over = step[back] + span
        if (
            time.min() >= 0.0
            and time.max() < span
            and over.min() > 0.0
            and over.max() <= LONGEST_STEP_OVER_END * usual
        ):
            return time + span * np.concatenate([[0.0], np.cumsum(back)])
    return values
