"""Coulomb (dry) friction: F = -F_c sgn(v), regularised as -F_c tanh(v / v_t).

The transition speed v_t is estimated together with F_c: fixed at a wrong value it would favour a more complex
friction law. A transition too sharp for the integration step h is widened to F_c h / (2 m), so that a sticking mass
comes to rest without chattering.
"""

import math

from rhythmid.elements.element import STEP, Element, Parameter


def kernel(x, v, t, f, force, transition, mass, step):
    return -force * math.tanh(v / max(transition, 0.5 * force * step / mass, 1e-300))


ELEMENT = Element(
    name="coulomb_friction",
    slot="force",
    title="Coulomb friction",
    equation="F = −F_c sgn v",
    parameters=(
        Parameter("force", "N", "friction force F_c while sliding", bounds=(0.0, math.inf)),
        Parameter(
            "transition", "m/s", "speed v_t over which the sign turns", bounds=(0.0, math.inf), default=1e-3
        ),
    ),
    borrows={"mass": ("inertia.mass", None), "step": (STEP, 1e-3)},
    kernel=kernel,
    size="force",
    starts=lambda s: [{"force": 0.02 * s.force, "transition": w * s.velocity} for w in (0.02, 0.2)],
    ranges=lambda s: {"transition": s.turning},
    against="base",
    also_known_as=("dry friction", "kinetic friction"),
    family="friction",
    special_case_of=(
        "asymmetric_coulomb_friction",
        "stribeck_friction",
        "lugre_friction",
        "elastoplastic_hysteresis",
        "bouc_wen_hysteresis",
        "soft_constraint_friction",
    ),
    confusable={
        "viscous_damper": "one amplitude only: Coulomb's apparent damping falls as 1/amplitude",
        "stribeck_friction": "differ near v = 0 alone: dwell at low speed, reverse slowly",
        "elastoplastic_hysteresis": "differ before sliding: small slow reversals",
        "bouc_wen_hysteresis": "differ before sliding: small slow reversals",
        "load_dependent_friction": "same at constant load: vary the actuator force",
        "transmitted_load_friction": "same at constant load: vary the load",
        "soft_constraint_friction": "differ at reversals alone, by the lead: reverse with a large acceleration",
    },
    switches=("v", ""),
    reference="B. Armstrong-Hélouvry, P. Dupont, C. Canudas de Wit, Automatica 30(7), 1994, 1083-1138",
)
