"""Command hold: the drive takes a new command only every P seconds and holds it (zero-order hold at its own rate).

A command waits for the next tick t = k P; of several waiting commands the last one is used. On average this is a
delay of P/2 with the roll-off of the hold. It is meant for commands that are themselves held between stamps. Ticks
are counted from the record's start; another phase of the ticks is equivalent to an additional delay of up to P.
"""

import math

import numpy as np

from rhythmid.elements.element import Element, Parameter


def delay_of(stamps, period):
    if period <= 0.0:
        return np.zeros(len(stamps))
    ticks = np.ceil(stamps / period - 1e-6)  # a command at the tick is in time
    return np.maximum(ticks * period - stamps, 0.0)


# [Hz] usual rates at which drives and buses take a new command
RATES = (500.0, 400.0, 250.0, 200.0, 125.0, 100.0, 80.0, 60.0, 50.0, 40.0, 30.0, 25.0, 20.0, 10.0, 5.0, 1.0)


ELEMENT = Element(
    name="command_hold",
    slot="command",
    title="Command hold",
    equation="ū(t) = u(k P) for k P ≤ t < (k + 1) P",
    parameters=(Parameter("period", "s", "period P of the drive's own clock", bounds=(0.0, math.inf)),),
    delay=delay_of,
    size="period",
    clock="period",
    # from twice the sample period to a quarter of the motion's period
    starts=lambda s: [
        {"period": 1.0 / rate} for rate in RATES if 1.5 * s.period < 1.0 / rate < 0.25 / s.frequency
    ],
    at_joint={  # faster ones do not show at the rates of records
        "starts": lambda s: [{"period": 1.0 / rate} for rate in RATES[4:14] if 4.0 * s.frequency < rate]
    },
    also_known_as=("zero-order hold", "down-sampled command", "bus cycle"),
    family="sampling",
    confusable={
        "input_delay": "a delay of P/2 but for the roll-off: excite high frequencies",
        "command_jitter": "its delay is a regular saw-tooth, not random",
        "command_lag": "half the period is a delay: rolls off differently",
    },
    reference="K. J. Åström, B. Wittenmark, Computer-Controlled Systems, 3rd ed., 1997, chapter 2",
)
