"""Constant force: F = F_0 (bias of the actuator, weight of a tilted axis)."""

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
    candidate=False,  # any spring's rest length absorbs it: calibration, not physics
    also_known_as=("bias force",),
    confusable={"sensor_offset": "not separable where a spring's rest length is free"},
    reference="Elementary mechanics",
)
