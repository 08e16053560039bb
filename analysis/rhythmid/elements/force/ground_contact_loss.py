"""Loss of ground contact: the leg's forces vanish, fully or partly, while it is longer than its rest length.

A modifier: all forces of the leg are multiplied by 1 - rho for e = x - rest length > 0. The force of a damped leg
jumps there. The jump is averaged over one integration step; the speed gives the share of the step after lift-off.
"""

from rhythmid.elements.element import STEP, Element, Parameter


def kernel(leg, x, v, t, f, loss, rest_length, step):
    e = x - rest_length
    half = 0.5 * abs(v) * step  # half of the travel in one step
    if e >= half:
        airborne = 1.0
    elif e <= -half:
        airborne = 0.0
    else:
        airborne = 0.5 + 0.5 * e / half
    return leg * (1.0 - loss * airborne)


ELEMENT = Element(
    name="ground_contact_loss",
    slot="force",
    title="Loss of ground contact",
    equation="leg force × (1 − ρ) for e > 0,  e = x − x₀",
    parameters=(
        Parameter("loss", "1", "share ρ of the leg's force that vanishes; 1 lifts off", bounds=(0.0, 1.0)),
    ),
    borrows={"rest_length": ("linear_spring.rest_length", None), "step": (STEP, 1e-3)},
    kernel=kernel,
    acts="modifier",
    size="loss",
    starts=lambda s: [{"loss": 0.3}],
    also_known_as=("lift-off", "unilateral contact", "flight phase"),
    family="contact",
    confusable={
        "bilinear_stiffness": "keeps the damping, and its kink is anywhere",
        "flight_damping": "acts beyond the rest length, not by direction",
    },
    switches=("x", "rest_length"),
    reference="P. Holmes, R. J. Full, D. Koditschek, J. Guckenheimer, SIAM Review 48(2), 2006, 207-304",
)
