"""Clock skew: the clock that stamps the measurements runs at 1 + epsilon times the robot's.

A measurement stamped t was taken at t / (1 + epsilon). The limit cycle's phase drifts relative to the record's
time; commands and forcing keep the robot's time.
"""

from rhythmid.elements.element import Element, Parameter


def delay_of(stamps, skew):
    return stamps * (skew / (1.0 + skew))


ELEMENT = Element(
    name="clock_skew",
    slot="timing",
    title="Clock skew",
    equation="y stamped t was taken at t / (1 + ε)",
    parameters=(Parameter("skew", "1", "relative error ε of the measuring clock", bounds=(-0.1, 0.1)),),
    delay=delay_of,
    size="skew",
    starts=lambda s: [{"skew": 0.02 / (s.natural_frequency * s.duration)}],
    also_known_as=("sample-rate error", "clock drift"),
    drifts=True,
    family="clock",
    same_as=("delay_drift",),
    confusable={
        "delay_drift": "observationally equivalent: only knowledge of the clocks separates them",
        "input_delay_drift": "moves the limit cycle's phase as well",
    },
    reference="S. B. Moon, P. Skelly, D. Towsley, INFOCOM 1999, 227-234",
)
