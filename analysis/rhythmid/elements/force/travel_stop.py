"""Travel stop: the end stop of a suspension, fixed to the base that the mass stands on and moving with it.

The contact is that of `end_stop_contact`, of which a stop that is fixed to the room is one.
"""

import math

from rhythmid.elements.element import STEP, Element, Parameter
from rhythmid.elements.force.end_stop_contact import kernel, starts

ELEMENT = Element(
    name="travel_stop",
    slot="force",
    title="Travel stop",
    equation="F = ∓max(0, k_s p + c_s ṗ),  p = ±(x − x_b − x_s) > 0,  c_s = 2ζ√(k_s m)",
    parameters=(
        Parameter("stiffness", "N/m", "contact stiffness k_s", bounds=(0.0, math.inf)),
        Parameter("damping_ratio", "1", "damping ratio ζ of the contact", bounds=(0.0, 10.0), default=0.1),
        Parameter("position", "m", "position x_s of the stop above the base"),
        Parameter(
            "side",
            "1",
            "+1: stop above (acts for x − x_b > x_s), −1: below",
            bounds=(-1.0, 1.0),
            default=1.0,
            fixed=True,
        ),
    ),
    borrows={"mass": ("inertia.mass", None), "step": (STEP, 1e-3)},
    kernel=kernel,
    displaced_base=True,
    size="stiffness",
    starts=starts,
    ranges=lambda s: {"position": (s.low, s.high)},
    also_known_as=("bump stop", "snubber", "bottoming out"),
    family="contact",
    confusable={
        "end_stop_contact": "is met at one place in the room, wherever the base is: move the base slowly",
        "bilinear_stiffness": "soft, undamped, pulls as well as it pushes",
    },
    reference="G. Gilardi, I. Sharf, Mechanism and Machine Theory 37(10), 2002, 1213-1239",
)
