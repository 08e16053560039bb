"""End stop: beyond x_s the mass meets a spring and a damper (Kelvin-Voigt contact) that push but never pull.

N = max(0, k_s p + c_s dp/dt) with the penetration p > 0 and c_s = 2 zeta sqrt(k_s m). zeta determines the
coefficient of restitution for any stiffness. The damper's jump at touch-down is averaged over one integration step.
"""

import math

from rhythmid.elements.element import STEP, Element, Parameter


def kernel(x, v, t, f, stiffness, damping_ratio, position, side, mass, step):
    direction = 1.0 if side > 0.0 else -1.0
    depth = direction * (x - position)
    closing = direction * v
    half = 0.5 * abs(v) * step  # half of the travel in one step
    if depth >= half:
        touching = 1.0
    elif depth <= -half:
        touching = 0.0
    else:
        touching = 0.5 + 0.5 * depth / half
    damping = 2.0 * damping_ratio * math.sqrt(stiffness * mass)
    return -direction * max(0.0, stiffness * max(depth, 0.0) + damping * closing * touching)


def starts(scales):
    """A soft stop within the travel, and a stiff one that is hardly reached, at either end."""
    travel = scales.high - scales.low
    return [
        {"stiffness": stiffness * scales.stiffness, "damping_ratio": 0.1, "position": place, "side": side}
        for stiffness, depth in ((0.3, 0.1), (3.0, 0.02))
        for place, side in ((scales.low + depth * travel, -1.0), (scales.high - depth * travel, 1.0))
    ]


ELEMENT = Element(
    name="end_stop_contact",
    slot="force",
    title="End stop",
    equation="F = ∓max(0, k_s p + c_s ṗ),  p = ±(x − x_s) > 0,  c_s = 2ζ√(k_s m)",
    parameters=(
        Parameter("stiffness", "N/m", "contact stiffness k_s", bounds=(0.0, math.inf)),
        Parameter("damping_ratio", "1", "damping ratio ζ of the contact", bounds=(0.0, 10.0), default=0.1),
        Parameter("position", "m", "position x_s of the stop"),
        Parameter(
            "side",
            "1",
            "+1: stop above (acts for x > x_s), −1: below",
            bounds=(-1.0, 1.0),
            default=1.0,
            fixed=True,
        ),
    ),
    borrows={"mass": ("inertia.mass", None), "step": (STEP, 1e-3)},
    kernel=kernel,
    acts="body",
    size="stiffness",
    rigid=True,
    stops=True,
    starts=starts,
    ranges=lambda s: {"position": (s.low, s.high)},
    also_known_as=("bump stop", "hard stop", "impact"),
    family="contact",
    confusable={"bilinear_stiffness": "soft, undamped, pulls as well as it pushes"},
    switches=("x", "position"),
    reference="G. Gilardi, I. Sharf, Mechanism and Machine Theory 37(10), 2002, 1213-1239",
)
