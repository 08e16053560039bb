"""Actuator dead band: zero force below the threshold d, f -/+ d beyond it (stiction of a valve, gate-drive dead time)."""

from math import inf

from rhythmid.elements.element import Element, Parameter


def kernel(f, t, threshold):
    return f - max(-threshold, min(threshold, f))


ELEMENT = Element(
    name="actuator_deadband",
    slot="actuator",
    title="Actuator dead band",
    equation="f → f ∓ δ for |f| > δ, 0 otherwise",
    parameters=(Parameter("threshold", "N", "half width δ of the dead band", bounds=(0.0, inf)),),
    kernel=kernel,
    size="threshold",
    starts=lambda s: [{"threshold": 0.03 * s.effort}] if s.effort > 0.0 else [],
    also_known_as=("dead zone",),
    family="actuator nonlinearity",
    confusable={
        "coulomb_friction": "its sign follows f, not v",
        "backlash": "has no memory: the force is lost near zero, not at reversals",
        "actuator_nonlinearity": "a gain that falls towards small forces, not large ones",
    },
    reference="A. Gelb, W. E. Vander Velde, Multiple-Input Describing Functions and Nonlinear System Design, 1968",
)
