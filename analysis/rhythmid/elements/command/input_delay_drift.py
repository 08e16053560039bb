"""Input delay drift: the command's delay grows with time, tau_u + r t (a queue that fills, a clock that drifts).

It acts on the command alone: the limit cycle, which is generated on the robot, keeps its phase. t is the command's stamp.
"""

from rhythmid.elements.element import Element, Parameter


def delay_of(stamps, rate):
    return rate * stamps


ELEMENT = Element(
    name="input_delay_drift",
    slot="command",
    title="Input delay drift",
    equation="ū(t) = u(t − r t)",
    parameters=(Parameter("rate", "1", "rate r of the delay", bounds=(-0.1, 0.1)),),
    delay=delay_of,
    size="rate",
    starts=lambda s: [{"rate": 0.02 / (s.natural_frequency * s.duration)}],
    also_known_as=("queue build-up", "latency drift"),
    drifts=True,
    family="clock",
    confusable={
        "clock_skew": "leaves the limit cycle's phase alone",
        "delay_drift": "leaves the limit cycle's phase alone",
    },
    reference="S. B. Moon, P. Skelly, D. Towsley, INFOCOM 1999, 227-234",
)
