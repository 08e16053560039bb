"""Dry friction as a physics engine's soft constraint: F = −clip(F_c (v + τ a) / v_t, ±F_c), with the mass's own acceleration a.

MuJoCo's `frictionloss` is this law, not F_c sgn v. Its constraint asks for the acceleration −b v, b = 2 / (d_max timeconst), with
the force −(a + b v) / R and never more than the friction loss; R = (1 − d) / d times the joint's `dof_invweight0`, with d the first
number of `solimp`. So τ = 1 / b (9.5 ms with its defaults) and v_t = F_c R / b: the sign turns τ earlier than the velocity does,
and a light joint creeps at up to v_t.

The force needs the acceleration that it takes part in. With a = a₀ + F y, where a₀ is what the acceleration would be without it and
the yielding y the inverse of the mass, F = −clip(F_c (v + τ a₀) / (v_t + F_c τ y), ±F_c). Along a measured motion the acceleration
contains the force already, and y = 0.
"""

import math

from rhythmid.elements.element import Element, Parameter

LEAD = 0.0095  # [s] with MuJoCo's defaults, 0.95 * 0.02 s / 2: d_max and timeconst of its solimp and solref


def kernel(acceleration, yielding, x, v, t, f, force, transition, lead):
    ramp = max(transition + force * lead * yielding, 1e-300)
    return -force * max(-1.0, min(1.0, (v + lead * acceleration) / ramp))


ELEMENT = Element(
    name="soft_constraint_friction",
    slot="force",
    acts="constraint",
    title="Dry friction as a soft constraint",
    equation="F = −clip(F_c (v + τ a) / v_t, ±F_c)",
    parameters=(
        Parameter("force", "N", "friction force F_c while sliding", bounds=(0.0, math.inf)),
        Parameter(
            "transition",
            "m/s",
            "speed v_t of the fastest creep under it",
            bounds=(0.0, math.inf),
            default=1e-3,
        ),
        Parameter(
            "lead",
            "s",
            "time τ by which its sign turns before the velocity's",
            bounds=(0.0, 0.1),
            default=LEAD,
        ),
    ),
    kernel=kernel,
    size="force",
    starts=lambda s: [
        {"force": 0.02 * s.force, "transition": w * s.velocity, "lead": LEAD} for w in (0.02, 0.1, 0.5)
    ],
    ranges=lambda s: {"transition": s.turning},
    candidate=False,
    also_known_as=("frictionloss", "regularised constraint"),
    family="friction",
    confusable={
        "coulomb_friction": "differ at reversals alone, by the lead: reverse with a large acceleration",
        "lugre_friction": "differ in what turns first: a bristle lags behind the velocity",
    },
    switches=("v", ""),
    reference="E. Todorov, ICRA 2014, 6054-6061; MuJoCo's documentation, Computation, sections Constraint model and Friction loss",
)
