"""Measurement delay: y(t) = y_bar(t - tau_y)."""

import math

import numpy as np

from rhythmid.elements.element import Element, Parameter


def delay_of(stamps, delay):
    return np.full(len(stamps), delay)


ELEMENT = Element(
    name="measurement_delay",
    slot="sensor",
    title="Measurement delay",
    equation="y(t) = ȳ(t − τ_y)",
    parameters=(
        Parameter("delay", "s", "delay τ_y of the measurement", bounds=(0.0, math.inf), default=0.0),
    ),
    delay=delay_of,
    size="delay",
    candidate=False,
    also_known_as=("sensor latency",),
    confusable={
        "input_delay": "separable only through sidebands or a limit cycle of known phase",
        "sensor_lag": "rolls off as well; excite high frequencies",
    },
    reference="Paper, section 3.1",
)
