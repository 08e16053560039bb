"""Friction of a gear that grows with the transmitted load: F = -|K_m f - K_e F_e| sgn(v).

Both sides load the gear: the motor with its force f, and the machine with F_e, the sum of the forces on the mass
other than the actuator's and losses (gravity, springs, attached parts). The two add where the motor holds or lifts
a load, because F_e then has the opposite sign. Where the load drives the motor (back-driving), the teeth are
relieved. K_m and K_e differ because a gear is not equally efficient in both directions: mu = K_m, r = K_e / K_m.
With r = 0 it is `load_dependent_friction`. It adds to the load-free level, a separate `coulomb_friction`, and
shares its regularised sign.
"""

import math

from rhythmid.elements.element import STEP, Element, Parameter


def kernel(load, x, v, t, f, coefficient, external_ratio, transition, mass, step):
    level = coefficient * abs(f - external_ratio * load)
    return -level * math.tanh(v / max(transition, 0.5 * level * step / mass, 1e-300))


ELEMENT = Element(
    name="transmitted_load_friction",
    slot="force",
    title="Friction that grows with the transmitted load",
    equation="F = −|K_m f − K_e F_e| sgn v,  μ = K_m,  r = K_e/K_m",
    parameters=(
        Parameter("coefficient", "1", "friction coefficient μ of the motor's force", bounds=(0.0, 1.0)),
        Parameter(
            "external_ratio",
            "1",
            "ratio r of the coefficients of the external and the motor's force",
            bounds=(0.0, 10.0),
            default=1.0,
        ),
        Parameter(
            "transition", "m/s", "speed v_t over which the sign turns", bounds=(0.0, math.inf), default=1e-3
        ),
    ),
    borrows={"mass": ("inertia.mass", None), "step": (STEP, 1e-3)},
    kernel=kernel,
    acts="transmission",
    size="coefficient",
    starts=lambda s: [
        {"coefficient": 0.05, "external_ratio": ratio, "transition": 0.1 * s.velocity} for ratio in (1.0, 0.3)
    ],
    ranges=lambda s: {"transition": s.turning},
    also_known_as=("directional load-dependent friction", "gearbox efficiency", "back-driving friction"),
    family="friction",
    confusable={
        "load_dependent_friction": "the same where the external load follows the motor's force: hold a load at rest, "
        "lift and lower it, drive it freely",
        "coulomb_friction": "the same at constant load: vary the load",
        "actuator_gain": "equivalent where f and v always have the same sign",
    },
    reference="M. Duclusaud, G. Passault, V. Padois, O. Ly, Extended friction models for the physics simulation of servo "
    "actuators, ICRA 2025, arXiv 2410.08650, models M3 and M5",
)
