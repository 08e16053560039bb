"""Delay drift of the measurement: the measurement delay grows with time, tau_y + r t.

Its counterpart for commands is `input_delay_drift`. A clock skew of epsilon = r / (1 - r) gives the same record: the two are
observationally equivalent without knowledge of the clocks, and are reported together.
"""

from rhythmid.elements.element import Element, Parameter


def delay_of(stamps, rate):
    return rate * stamps


ELEMENT = Element(
    name="delay_drift",
    slot="timing",
    title="Measurement delay drift",
    equation="y(t) = ȳ(t − r t)",
    parameters=(Parameter("rate", "1", "rate r of the measurement delay", bounds=(-0.1, 0.1)),),
    delay=delay_of,
    size="rate",
    starts=lambda s: [{"rate": 0.02 / (s.natural_frequency * s.duration)}],
    also_known_as=("latency drift",),
    drifts=True,
    family="clock",
    same_as=("clock_skew",),
    confusable={
        "clock_skew": "observationally equivalent: only knowledge of the clocks separates them",
        "input_delay_drift": "moves the limit cycle's phase as well",
    },
    reference="S. B. Moon, P. Skelly, D. Towsley, INFOCOM 1999, 227-234",
)
