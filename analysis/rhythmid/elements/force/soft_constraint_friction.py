"""Dry friction as a physics engine's soft constraint: F = −clip(m (a + v / τ) / s, ±F_c), with the mass's own acceleration a.

MuJoCo's `frictionloss` is this law, not F_c sgn v. Its constraint requests the acceleration −b v, b = 2 / (d_max
timeconst), with the force −(a + b v) / R, limited to the friction loss. R = (1 − d) / d times the joint's
`dof_invweight0`, with d the first number of `solimp`. So τ = 1 / b (9.5 ms with its defaults) and s = m R (1/9
where nothing else moves with the joint). The sign reverses τ earlier than the velocity does, and a light joint
creeps at up to v_t = F_c τ s / m.

The force depends on the acceleration to which it contributes. With a = a₀ + F y, where a₀ is the acceleration
without it and the yielding y the inverse of the mass, F = −clip(F_c (v + τ a₀) / (v_t + F_c τ y), ±F_c). Along a
measured motion the acceleration already contains the force, and y = 0.

Lead and softness are the engine's numbers and are hardly ever changed, so the search keeps close to them. A
friction with a free lead would fit timing errors of stamps, and one with a free softness a viscous damper.
"""

import math

from rhythmid.elements.element import Element, Parameter

LEAD = 0.0095  # [s] with MuJoCo's defaults, 0.95 * 0.02 s / 2: d_max and timeconst of its solimp and solref
SOFTNESS = 1.0 / 9.0  # with MuJoCo's defaults, (1 - d) / d with d = 0.9
NEAR_LEAD = (0.9, 1.1)  # range of the search, times LEAD: recorded motions give it within 5 %
# range of the search, times SOFTNESS: neighbouring joints make a joint seem lighter or heavier
NEAR_SOFTNESS = (0.25, 4.0)


def kernel(acceleration, yielding, x, v, t, f, force, softness, lead, mass):
    ramp = max(force * lead * (softness / mass + yielding), 1e-300)
    return -force * max(-1.0, min(1.0, (v + lead * acceleration) / ramp))


ELEMENT = Element(
    name="soft_constraint_friction",
    slot="force",
    acts="constraint",
    title="Dry friction as a soft constraint",
    equation="F = −clip(m (a + v / τ) / s, ±F_c)",
    parameters=(
        Parameter("force", "N", "friction force F_c while sliding", bounds=(0.0, math.inf)),
        Parameter(
            "softness",
            "1",
            "softness s: the mass times the constraint's regularisation R",
            bounds=(0.0, math.inf),
            default=SOFTNESS,
        ),
        Parameter(
            "lead",
            "s",
            "time τ by which its sign turns before the velocity's",
            bounds=(0.0, 0.1),
            default=LEAD,
        ),
    ),
    borrows={"mass": ("inertia.mass", None)},
    kernel=kernel,
    size="force",
    starts=lambda s: [
        {"force": share * s.force, "softness": SOFTNESS, "lead": LEAD} for share in (0.02, 0.1, 0.5)
    ],
    ranges=lambda s: {
        "softness": (NEAR_SOFTNESS[0] * SOFTNESS, NEAR_SOFTNESS[1] * SOFTNESS),
        "lead": (NEAR_LEAD[0] * LEAD, NEAR_LEAD[1] * LEAD),
    },
    candidate=False,
    at_joint={"candidate": True},  # the friction model of simulated robots
    also_known_as=("frictionloss", "regularised constraint"),
    family="friction",
    confusable={
        "coulomb_friction": "differ at reversals alone, by the lead: reverse with a large acceleration",
        "lugre_friction": "differ in what turns first: a bristle lags behind the velocity",
    },
    switches=("v", ""),
    reference="E. Todorov, ICRA 2014, 6054-6061; MuJoCo's documentation, Computation, sections Constraint model and Friction loss",
)
