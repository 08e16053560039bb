"""Load-dependent friction of a gear or a bearing: F = -mu |f| sgn(v), with f the transmitted actuator force.

Only the motor loads it. For gravity, springs or an attached machine that load the gear from the other side, see
`transmitted_load_friction`. It adds to the load-free level, which is a separate `coulomb_friction`. The sign is
regularised as there.
"""

import math

from rhythmid.elements.element import STEP, Element, Parameter


def kernel(x, v, t, f, coefficient, transition, mass, step):
    level = coefficient * abs(f)
    return -level * math.tanh(v / max(transition, 0.5 * level * step / mass, 1e-300))


ELEMENT = Element(
    name="load_dependent_friction",
    slot="force",
    title="Load-dependent friction",
    equation="F = −μ |f| sgn v",
    parameters=(
        Parameter("coefficient", "1", "friction coefficient μ", bounds=(0.0, 1.0)),
        Parameter(
            "transition", "m/s", "speed v_t over which the sign turns", bounds=(0.0, math.inf), default=1e-3
        ),
    ),
    borrows={"mass": ("inertia.mass", None), "step": (STEP, 1e-3)},
    kernel=kernel,
    size="coefficient",
    driven=True,
    starts=lambda s: [{"coefficient": 0.05, "transition": 0.1 * s.velocity}],
    ranges=lambda s: {"transition": s.turning},
    also_known_as=("gear friction", "torque-dependent friction"),
    family="friction",
    special_case_of=("transmitted_load_friction",),  # for an external ratio of 0
    confusable={
        "coulomb_friction": "same at constant load: vary the actuator force",
        "transmitted_load_friction": "the same where the external load follows the motor's force: hold, lift and lower a load",
        "viscous_damper": "one amplitude only",
        "actuator_gain": "equivalent where f and v always have the same sign",
    },
    reference="M. Duclusaud et al., Extended friction models for the physics simulation of servo actuators, "
    "ICRA 2025, arXiv 2410.08650",
)
