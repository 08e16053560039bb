"""Viscous damper: F = -c v."""

from math import inf

from rhythmid.elements.element import Element, Parameter


def kernel(x, v, t, f, damping):
    return -damping * v


ELEMENT = Element(
    name="viscous_damper",
    slot="force",
    title="Viscous damper",
    equation="F = −c v",
    parameters=(Parameter("damping", "N*s/m", "damping c", bounds=(0.0, inf)),),
    kernel=kernel,
    size="damping",
    starts=lambda s: [{"damping": 0.02 * (s.stiffness * s.mass) ** 0.5}],
    against="base",
    also_known_as=("dashpot", "linear damper"),
    family="damping",
    # for τ_m → 0; for a mode far below the motion
    special_case_of=("viscoelastic_relaxation", "second_mode"),
    needless_with=("switched_damper",),  # equivalent to flight damping and a free stance damping
    confusable={
        "coulomb_friction": "one amplitude only: Coulomb's apparent damping falls as 1/amplitude",
        "quadratic_drag": "one amplitude only: drag's apparent damping grows with amplitude",
        "flight_damping": "the same model where a switched damper's stance damping is free",
    },
    reference="Any text on vibrations, e.g. D. J. Inman, Engineering Vibration",
)
