"""Elastoplastic hysteresis: a spring that yields, F = -k_h z, with dz/dt = v (1 - (z / z_y)^2) while loading, else v.

The smooth Jenkins element (Bouc-Wen with exponent 2 and no degradation): stiff at reversals, sliding at the force
k_h z_y. The loop does not depend on speed. Coulomb friction is its limit for z_y -> 0 with k_h z_y kept. The state
is the share z / z_y. Where the mass travels more than z_y in one integration step, the state changes over that
travel instead, with the same sliding force.
"""

from math import inf

from rhythmid.elements.element import STEP, Element, Parameter


def kernel(x, v, t, f, stiffness, yield_displacement, step, share):
    rate = v / max(yield_displacement, abs(v) * step, 1e-300)
    if v * share > 0.0:
        rate *= 1.0 - share * share
    return -stiffness * yield_displacement * share, rate


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
    states=("share",),
    size="stiffness",
    starts=lambda s: [
        {"stiffness": 0.02 * s.stiffness / w, "yield_displacement": w * s.position} for w in (0.1, 0.4, 1.2)
    ],
    # reversal of sliding takes two yield displacements: in cycles of a shorter travel it is a spring (the
    # difference from a spring is 3 % of its mean square at the end of this range, 0.2 % at twice that)
    ranges=lambda s: {"yield_displacement": (0.0, 0.5 * (s.high - s.low))},
    against="base",
    reversing=True,
    also_known_as=(
        "Jenkins element",
        "Iwan element",
        "Bouc-Wen hysteresis with exponent 2",
        "presliding friction",
    ),
    family="friction",
    confusable={
        "bouc_wen_hysteresis": "differs in the curvature of the loop at its knee: reversals of many sizes",
        "coulomb_friction": "differ before sliding: small slow reversals",
        "viscoelastic_relaxation": "its loop does not depend on speed: repeat slower",
        "lugre_friction": "its friction does not fall with speed",
    },
    reference="Y.-K. Wen, Journal of the Engineering Mechanics Division ASCE 102(2), 1976, 249-263",
)
