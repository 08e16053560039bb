"""Times from a counter with a limited number of bits, which restarts at its lowest number: micros() of a microcontroller
after 71.6 minutes."""

from typing import Any

import numpy as np

# spans of counters, and of µs counters that are written in ms or s
SPANS = {
    2.0**16: "16 bits",
    2.0**24: "24 bits",
    2.0**32: "32 bits",
    2.0**32 * 1e-3: "32 bits in thousandths",
    2.0**32 * 1e-6: "32 bits in millionths",
}
LONGEST_STEP_OVER_END = 3.0  # largest step across the restart, in usual steps: a lost sample may be included
# the same as a share of the span, which is how rarely another recording begins by chance where a counter would restart
MISTAKEN = 1e-3


def unwrapped(values: Any) -> tuple[Any, str | None]:
    """A column with the counts before each restart added, and a phrase that says so; unchanged, and None, where no
    counter has restarted.

    A step back is a restart if it is smaller than the counter's span by the size of a few forward steps, or by so small a
    share of the span that another recording would hardly begin there by chance.
    """
    time = np.asarray(values)
    if time.dtype.kind not in "fiu" or time.ndim != 1 or len(time) < 3:
        return values, None
    time = time.astype(np.float64)
    step = np.diff(time)
    back = step < 0.0
    if not back.any() or not (step > 0.0).any():
        return values, None
    usual = float(np.median(step[step > 0.0]))
    for span, bits in SPANS.items():
        over = step[back] + span
        lowest = 0.0 if time.min() >= 0.0 else -0.5 * span
        within = time.min() >= lowest and time.max() < lowest + span
        if within and over.min() > 0.0 and over.max() <= max(LONGEST_STEP_OVER_END * usual, MISTAKEN * span):
            found = time + span * np.concatenate([[0.0], np.cumsum(back)])
            row = 2 + int(np.argmax(back))
            times = "once" if back.sum() == 1 else f"{int(back.sum())} times"
            return (
                found,
                f"begins anew {times} as a counter of {bits} does, first in row {row}: it is continued",
            )
    return values, None
