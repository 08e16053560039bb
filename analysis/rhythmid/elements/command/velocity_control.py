"""Velocity control: the force of a controller that drives the mass at its reference speed r, F = k_v (r - v).

It closes the loop around the machine. Its input, the command u after the other command elements, is the speed
reference. Its output is the force on which forcing and actuator elements act. A nominal element.
"""

from math import inf

from rhythmid.elements.element import Element, Parameter


def kernel(f, x, v, t, gain):
    return gain * (f - v)


ELEMENT = Element(
    name="velocity_control",
    slot="command",
    title="Velocity control",
    equation="F = k_v (r − v)",
    parameters=(Parameter("gain", "N*s/m", "gain k_v", bounds=(0.0, inf)),),
    kernel=kernel,
    acts="feedback",
    size="gain",
    candidate=False,
    also_known_as=("speed control", "velocity servo"),
    family="control",
    confusable={"viscous_damper": "the same where the reference rests"},
    reference="B. Siciliano, L. Sciavicco, L. Villani, G. Oriolo, Robotics, 2009, section 8.3",
)
