"""A sample period or rate that a text table's head states in words: `Sampling Period : 4 ms`, `# sample rate = 1 kHz`."""

import re
from collections.abc import Iterable

STATED = re.compile(
    r"(?<![A-Za-z])(?P<name>(?:(?:sample|sampling|acquisition)[ _]?(?:period|interval|time|rate|frequency)))"
    r"\s*[:=]?\s*(?P<value>\d+(?:[.,]\d+)?(?:[eE][-+]?\d+)?)\s*(?P<unit>[a-zA-Zµ]+)(?![A-Za-z])",
    re.IGNORECASE,
)
PERIOD = {"s": 1.0, "sec": 1.0, "seconds": 1.0, "ms": 1e-3, "msec": 1e-3, "us": 1e-6, "µs": 1e-6}  # [s]
RATE = {"hz": 1.0, "khz": 1e3}  # [Hz]
NAME_OF_PERIOD, NAME_OF_RATE = "sample_period", "sample_rate"


def stated_above(lines: Iterable[str]) -> dict[str, float]:
    """The sample period [s] or rate [Hz] by its name that the first line with one states together with its unit; empty
    where none does.

    A number without a unit is left alone: it may be of any unit.
    """
    for line in lines:
        for found in STATED.finditer(line):
            value, unit = float(found["value"].replace(",", ".")), found["unit"].lower()
            if value > 0.0 and unit in PERIOD:
                return {NAME_OF_PERIOD: value * PERIOD[unit]}
            if value > 0.0 and unit in RATE:
                return {NAME_OF_RATE: value * RATE[unit]}
    return {}
