"""Bouc-Wen hysteresis with exponent 1: F = -k_h z, dz/dt = v [1 - |z| / z_y (s sgn(v z) + 1 - s)].

The smooth one of the family: from a reversal on, the curve bends gradually towards the sliding force k_h z_y, which
`elastoplastic_hysteresis` (exponent 2) reaches with a knee. The loop does not depend on speed. The shape s is 1/2
for unloading along the elastic line (Wen's beta = gamma) and 1 for Dahl's friction; below 1/2 the loop would
generate energy. The state is the share z / z_y. Where the mass travels more than z_y in one integration step, the
state changes over that travel instead, with the same sliding force. Coulomb friction is its limit for z_y -> 0 with
k_h z_y kept.
"""

from math import inf

from rhythmid.elements.element import STEP, Element, Parameter


def kernel(x, v, t, f, stiffness, yield_displacement, shape, step, share):
    bend = shape if v * share > 0.0 else -shape
    rate = v / max(yield_displacement, abs(v) * step, 1e-300) * (1.0 - abs(share) * (bend + 1.0 - shape))
    return -stiffness * yield_displacement * share, rate


ELEMENT = Element(
    name="bouc_wen_hysteresis",
    slot="force",
    title="Bouc-Wen hysteresis",
    equation="F = −k_h z,  ż = v [1 − |z|/z_y (s sgn(v z) + 1 − s)]",
    parameters=(
        Parameter("stiffness", "N/m", "stiffness k_h at a reversal from rest", bounds=(0.0, inf)),
        Parameter("yield_displacement", "m", "displacement z_y over which it yields", bounds=(0.0, inf)),
        Parameter("shape", "1", "shape s of the loop", bounds=(0.5, 1.0), default=0.5, fixed=True),
    ),
    borrows={"step": (STEP, 1e-3)},
    kernel=kernel,
    states=("share",),
    size="stiffness",
    starts=lambda s: [
        {"stiffness": 0.02 * s.stiffness / w, "yield_displacement": w * s.position, "shape": 0.5}
        for w in (0.1, 0.4, 1.2)
    ],
    # reversal of sliding takes two yield displacements: in cycles of a shorter travel it approaches a spring (the
    # difference from a spring is 7 % of its mean square at the end of this range, 1.5 % at twice that)
    ranges=lambda s: {"yield_displacement": (0.0, 0.5 * (s.high - s.low))},
    against="base",
    reversing=True,
    also_known_as=("smooth hysteresis", "Dahl friction", "presliding friction"),
    family="friction",
    confusable={
        "elastoplastic_hysteresis": "differs in the curvature of the loop at its knee: reversals of many sizes",
        "coulomb_friction": "differ before sliding: small slow reversals",
        "viscoelastic_relaxation": "its loop does not depend on speed: repeat slower",
        "lugre_friction": "the same without bristle damping and Stribeck fall for s = 1",
    },
    reference="Y.-K. Wen, Journal of the Engineering Mechanics Division ASCE 102(2), 1976, 249-263; "
    "S. Erlicher, N. Point, Comptes Rendus Mécanique 332(1), 2004, 51-57",
)
