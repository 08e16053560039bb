"""Freeplay: the linear spring engages only outside a gap b around its rest length, as in a worn joint.

As an addition to the nominal spring: F = +k clip(e, -b/2, b/2), which leaves -k (e -/+ b/2) outside the gap and
zero inside. Under a weight the spring works on one side of the gap. If that edge is out of reach, only a constant
force remains. So the search keeps an edge within the travel where the rest length is known.
"""

from math import inf

from rhythmid.elements.element import Element, Parameter


def kernel(x, v, t, f, gap, stiffness, rest_length):
    half = 0.5 * gap
    return stiffness * max(-half, min(half, x - rest_length))


def edges(scales):
    """The smallest and the largest gap with an edge within the travel."""
    if scales.rest is None:
        return 0.0, inf
    low, high = (end - scales.rest for end in scales.inside)
    nearest = 0.0 if low < 0.0 < high else min(abs(low), abs(high))
    return 2.0 * nearest, 2.0 * max(abs(low), abs(high))


def starts(scales):
    nearest, farthest = edges(scales)
    return [{"gap": min(nearest + share * scales.position, farthest)} for share in (0.1, 0.5)]


ELEMENT = Element(
    name="freeplay",
    slot="force",
    title="Freeplay",
    equation="F = +k clip(e, −b/2, b/2),  e = x − x₀",
    parameters=(Parameter("gap", "m", "width b of the gap", bounds=(0.0, inf)),),
    borrows={
        "stiffness": ("linear_spring.stiffness", None),
        "rest_length": ("linear_spring.rest_length", 0.0),
    },
    kernel=kernel,
    size="gap",
    starts=starts,
    ranges=lambda s: {"gap": edges(s)},
    also_known_as=("backlash in the joint", "dead zone in the spring", "gap"),
    family="stiffness",
    confusable={
        "cubic_stiffness": "kinks at both ends of the gap; the resonance falls towards small amplitudes",
        "backlash": "has no memory",
        "actuator_deadband": "in the position, not in the actuator force",
    },
    reference="M. D. Conner, D. M. Tang, E. H. Dowell, L. N. Virgin, Journal of Fluids and Structures 11(1), 1997, 89-109",
)
