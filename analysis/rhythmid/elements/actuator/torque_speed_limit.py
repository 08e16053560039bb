"""Torque-speed limit: the force available from the supply decreases with the motor's speed, to zero at the no-load speed.

A current controller has at most the supply voltage V, of which the back-EMF takes k_t v. So the force is at most
k_t (V - k_t v) / R = s (v0 - v), with the no-load speed v0 = V / k_t and the slope s = k_t^2 / R. Below that line
the force is the commanded one. Drives of legged robots reach the limit in swing and in jumps; at low speeds it is
not identifiable. An additional current limit is an `actuator_saturation`.
"""

from math import inf

from rhythmid.elements.element import Element, Parameter


def kernel(f, x, v, t, speed, slope):
    return max(-slope * (speed + v), min(slope * (speed - v), f))


ELEMENT = Element(
    name="torque_speed_limit",
    slot="actuator",
    title="Torque-speed limit",
    equation="f → clip(f, −s (v₀ + v), s (v₀ − v))",
    parameters=(
        Parameter("speed", "m/s", "speed v₀ at which no force is left: the no-load speed", bounds=(0.0, inf)),
        Parameter("slope", "N*s/m", "force s lost per unit of speed", bounds=(0.0, inf)),
    ),
    kernel=kernel,
    acts="transducer",
    size="speed",
    absent=inf,
    starts=lambda s: [
        {"speed": w * s.velocity, "slope": steep * s.effort / s.velocity}
        for w in (1.2, 1.7, 2.5)
        for steep in (1.0, 5.0)
        if s.effort > 0.0 and s.velocity > 0.0
    ],
    also_known_as=(
        "speed-torque curve",
        "voltage limit",
        "field weakening limit",
        "velocity limit of a motor",
    ),
    family="actuator nonlinearity",
    confusable={
        "actuator_saturation": "limits the force at every speed: ask for large forces at rest and at high speed",
        "reference_rate_limit": "limits the set point's speed: command a force, or look at moves that overshoot",
        "quadratic_drag": "brakes the machine when it coasts, too",
        "dc_motor": "a motor fed with a voltage loses force at every speed, not only at the limit",
    },
    reference="B. Siciliano, L. Sciavicco, L. Villani, G. Oriolo, Robotics, 2009, section 5.2",
)
