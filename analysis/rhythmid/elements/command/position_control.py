"""Position control: the force of a controller that drives the mass to its reference r, F = k_p (r - x) - k_d v.

It closes the loop around the machine. Its input, the command u after the other command elements, is the position
reference. Its output is the force on which forcing and actuator elements act. A nominal element: its gains are
known from the drive's settings, or free where they are not.
"""

from math import inf

from rhythmid.elements.element import Element, Parameter


def kernel(f, x, v, t, proportional, derivative):
    return proportional * (f - x) - derivative * v


ELEMENT = Element(
    name="position_control",
    slot="command",
    title="Position control",
    equation="F = k_p (r − x) − k_d v",
    parameters=(
        Parameter("proportional", "N/m", "proportional gain k_p", bounds=(0.0, inf)),
        Parameter(
            "derivative",
            "N*s/m",
            "derivative gain k_d, on the measured speed",
            bounds=(0.0, inf),
            default=0.0,
        ),
    ),
    kernel=kernel,
    acts="feedback",
    size="proportional",
    candidate=False,
    also_known_as=("PD control", "impedance control", "position servo"),
    family="control",
    confusable={
        "linear_spring": "the same where the reference rests",
        "viscous_damper": "the same as the derivative gain: record the motor's effort to separate them",
    },
    reference="B. Siciliano, L. Sciavicco, L. Villani, G. Oriolo, Robotics, 2009, section 8.5",
)
