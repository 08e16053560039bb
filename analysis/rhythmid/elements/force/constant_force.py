"""Constant force: F = F_0 (bias of the actuator, weight on a tilted axis).

A candidate only where no estimated parameter absorbs it, such as the rest length of a spring or the weight.
"""

from rhythmid.elements.element import Element, Parameter


def kernel(x, v, t, f, force):
    return force


ELEMENT = Element(
    name="constant_force",
    slot="force",
    title="Constant force",
    equation="F = F₀",
    parameters=(Parameter("force", "N", "force F₀ along +x"),),
    kernel=kernel,
    acts="body",
    size="force",
    starts=lambda s: [{"force": 0.02 * s.force}],
    # an estimated rest length, hanging position or weight absorbs it
    needless_with=(
        "linear_spring.rest_length",
        "pendulum_gravity.reference",
        "gravity.acceleration",
    ),
    special_case_of=("linear_spring",),  # for a rest length far outside the travel
    also_known_as=("bias force",),
    confusable={
        "sensor_offset": "the same on a linear spring: record the effort at rest",
        "asymmetric_coulomb_friction": "never changes sign: record the machine at rest",
        "linear_spring": "a displacement of its rest length: move over a wide range",
    },
    reference="Elementary mechanics",
)
