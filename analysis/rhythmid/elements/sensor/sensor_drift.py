"""Sensor drift: y = x + b t, a zero that drifts with time.

t is the time of the measurement in the record's time, zero at its start.
"""

from rhythmid.elements.element import Element, Parameter


def kernel(y, t, rate):
    return y + rate * t


ELEMENT = Element(
    name="sensor_drift",
    slot="sensor",
    title="Sensor drift",
    equation="y → y + b t",
    parameters=(Parameter("rate", "m/s", "rate b of the zero"),),
    kernel=kernel,
    size="rate",
    starts=lambda s: [{"rate": 0.02 * s.position / s.duration}],
    also_known_as=("zero drift", "thermal drift of the sensor"),
    family="drift",
    confusable={
        "stiffness_drift": "leaves the resonance alone: repeat the first experiment at the end",
        "actuator_fade": "does not grow with the force",
    },
    reference="J. Fraden, Handbook of Modern Sensors, 5th ed., 2016, chapter 3",
)
