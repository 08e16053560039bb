"""DC motor driven by a voltage: f = (k_t / R) (V_s d - k_t v), its current (V_s d - k_t v) / R times its torque constant.

d is the input signal of the motor, in volts with `supply` = 1, or a duty cycle in [-1, 1] with `supply` the bus
voltage V_s. In SI units the torque constant [N*m/A] is also the back-EMF constant [V*s/rad]. The constants refer to
the output: for a motor with a gear of ratio n, k_t is n times the motor's own. The inductance is left out. Its time
constant L / R, a millisecond or less, is an `actuator_lag` before the motor where it matters. Friction, the rotor's
inertia and a voltage limit (an `actuator_saturation` before the motor) are separate elements.

A position servo that controls its voltage is a `position_control` in the command path and this motor. The
controller's output, and every element before the motor, is then in volts, so a gain k_p [N*m/rad] has the unit
[V/rad]. A nominal element: in a machine driven by a force it adds only a gain and a viscous damping k_t^2 / R.
"""

from math import inf

from rhythmid.elements.element import Element, Parameter


def kernel(f, x, v, t, torque_constant, resistance, supply):
    return torque_constant * (supply * f - torque_constant * v) / max(resistance, 1e-300)


ELEMENT = Element(
    name="dc_motor",
    slot="actuator",
    title="DC motor",
    equation="f = k_t i,  i = (V_s d − k_t v)/R",
    parameters=(
        Parameter("torque_constant", "N/A", "torque (force) constant k_t, at the output", bounds=(0.0, inf)),
        Parameter("resistance", "ohm", "winding resistance R", bounds=(0.0, inf)),
        Parameter(
            "supply",
            "V",
            "supply voltage V_s of a duty cycle; 1 for a command in volts",
            default=1.0,
            fixed=True,
        ),
    ),
    kernel=kernel,
    acts="transducer",
    takes="V",
    candidate=False,
    also_known_as=("permanent-magnet motor", "voltage-controlled motor", "back-EMF"),
    family="motor",
    confusable={
        "viscous_damper": "its back-EMF is a viscous damping k_t²/R: with k_t, R and c all free only k_t/R and "
        "k_t²/R + c are identifiable: fix one of them, such as a measured R, or c at 0",
        "actuator_gain": "the same gain k_t/R without back-EMF: look at the damping",
        "position_control": "scales its gains by k_t/R: give the gains from the drive's settings",
    },
    reference="B. Siciliano, L. Sciavicco, L. Villani, G. Oriolo, Robotics, 2009, section 5.2",
)
