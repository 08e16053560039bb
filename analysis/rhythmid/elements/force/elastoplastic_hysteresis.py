"""Elastoplastic hysteresis: a spring that yields, F = -k_h z, with dz/dt = v (1 - (z / z_y)^2) while loading, else v.

The smooth Jenkins element (Bouc-Wen with exponent 2 and no degradation): stiff at reversals, sliding at the force
k_h z_y; the loop does not depend on speed. Coulomb friction is its limit for z_y -> 0 with k_h z_y kept. A yield
displacement shorter than the way travelled in one integration step is lengthened to it, at the same sliding force.
"""

from math import inf

from rhythmid.elements.element import STEP, Element, Parameter


def kernel(x, v, t, f, stiffness, yield_displacement, step, deflection):
    reach = max(yield_displacement, abs(v) * step, 1e-300)
    share = max(-1.0, min(1.0, deflection / reach))
    loading = v * deflection > 0.0
    return -stiffness * yield_displacement * share, v * (1.0 - share * share) if loading else v


ELEMENT = Element(
    name="elastoplastic_hysteresis",
    slot="force",
    title="Elastoplastic hysteresis",
    equation="F = −k_h z,  ż = v (1 − (z/z_y)²) while z v > 0, v otherwise",
    parameters=(
        Parameter("stiffness", "N/m", "stiffness k_h before yielding", bounds=(0.0, inf)),
        Parameter("yield_displacement", "m", "displacement z_y at which it slides", bounds=(0.0, inf)),
    ),
    borrows={"step": (STEP, 1e-3)},
    kernel=kernel,
    states=("deflection",),
    size="stiffness",
    starts=lambda s: [
        {"stiffness": 0.02 * s.stiffness / w, "yield_displacement": w * s.position} for w in (0.1, 0.4, 1.5)
    ],
    also_known_as=("Jenkins element", "Iwan element", "Bouc-Wen hysteresis", "presliding friction", "Dahl friction"),
    family="friction",
    confusable={
        "coulomb_friction": "differ before sliding: small slow reversals",
        "viscoelastic_relaxation": "its loop does not depend on speed: repeat slower",
        "lugre_friction": "has no fall of friction with speed",
    },
    reference="Y.-K. Wen, Journal of the Engineering Mechanics Division ASCE 102(2), 1976, 249-263",
)
