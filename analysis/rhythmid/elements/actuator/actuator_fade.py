"""Actuator fade: the force decreases with time, (1 - beta t) f, because of a draining battery or a heating motor.

t is the record's time; the fading begins at its start.
"""

from rhythmid.elements.element import Element, Parameter


def kernel(f, t, rate):
    return (1.0 - rate * max(t, 0.0)) * f


ELEMENT = Element(
    name="actuator_fade",
    slot="actuator",
    title="Actuator fade",
    equation="f → (1 − β t) f",
    parameters=(Parameter("rate", "1/s", "relative rate β of the loss"),),
    kernel=kernel,
    size="rate",
    starts=lambda s: [{"rate": 0.01 / s.duration}],
    also_known_as=("battery sag", "thermal derating"),
    drifts=True,
    family="drift",
    confusable={
        "stiffness_drift": "changes the gain, not the resonance: repeat the first experiment at the end",
        "sensor_drift": "grows with the force",
    },
    reference="D. Hanselman, Brushless Permanent Magnet Motor Design, 2nd ed., 2003, for the loss of torque with heat",
)
