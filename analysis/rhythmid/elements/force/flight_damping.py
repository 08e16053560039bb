"""Flight damping: F = -c_f v for v <= 0, the phase in which the paper's switched damper is off.

The force is continuous at the switch; only its slope jumps. Together with a free stance damping it gives the same
models as a viscous damper in both phases.
"""

from math import inf

from rhythmid.elements.element import Element, Parameter


def kernel(x, v, t, f, damping):
    return -damping * min(v, 0.0)


ELEMENT = Element(
    name="flight_damping",
    slot="force",
    title="Flight damping",
    equation="F = −c_f v for v ≤ 0",
    parameters=(Parameter("damping", "N*s/m", "damping c_f while v ≤ 0", bounds=(0.0, inf)),),
    kernel=kernel,
    size="damping",
    starts=lambda s: [{"damping": 0.02 * s.damping}],
    also_known_as=("rebound damping", "asymmetric damping"),
    family="damping",
    # for τ_m → 0; for a mode far below the motion, with the stance damping absorbing the rest
    special_case_of=("viscoelastic_relaxation", "second_mode"),
    same_beside={"switched_damper": "viscous_damper"},
    confusable={
        "viscous_damper": "the same model where the stance damping is free",
        "viscoelastic_relaxation": "short relaxation times: excite high frequencies, or a bias force",
        "quadratic_drag": "one amplitude only",
    },
    switches=("v", ""),
    reference="Paper, equation (10), with the damper's flight value",
)
