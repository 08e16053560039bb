"""Times from a counter with a limited number of bits, which restarts at zero: micros() of a microcontroller after
71.6 minutes."""

from typing import Any

import numpy as np

# spans of counters, and of µs counters that are written in ms or s
SPANS = (2.0**16, 2.0**32, 2.0**32 * 1e-3, 2.0**32 * 1e-6)
LONGEST_STEP_OVER_END = 3.0  # largest step across the restart, in usual steps: a lost sample may be included


def unwrapped(values: Any) -> Any:
    """A column with the counts before each restart added; unchanged where no counter has restarted.

    A step back is a restart if it is smaller than the counter's span by the size of a few forward steps.
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
