"""Switching threshold: the direction-switched damper turns on at v = v_th instead of v = 0.

A modifier of the leg's forces: it adds -(c_s - c_f) v ([v > v_th] - [v > 0]) to the nominal damper. The force now
jumps at the switch. Both brackets rise over the transition and the speed gained in one integration step, as
computed from the forces on the mass. So the effect vanishes exactly at v_th = 0 and can be differentiated with
respect to v_th. Where the speed reverses near the threshold, a sharp switch has many local minima, so fits start
with a wide transition and estimate it. A transition is limited to half the threshold: a wider one is no switch, but
a smooth damper curve that can represent any friction. The effect grows with the square of small thresholds, so fits
need starts of physical size.
"""

import math

from rhythmid.elements.element import STEP, Element, Parameter


def kernel(leg, x, v, t, f, threshold, transition, stance, flight, mass, gravity, step):
    gained = abs((leg + f) / mass - gravity) * step  # speed gained in one step
    half = min(transition, 0.5 * abs(threshold)) + max(0.5 * gained, 1e-300)
    beyond = min(1.0, max(0.0, 0.5 + 0.5 * (v - threshold) / half))
    upward = min(1.0, max(0.0, 0.5 + 0.5 * v / half))
    return leg - (stance - flight) * v * (beyond - upward)


ELEMENT = Element(
    name="switching_threshold",
    slot="force",
    title="Switching threshold",
    equation="F = −c_s v for v > v_th, −c_f v otherwise",
    parameters=(
        Parameter("threshold", "m/s", "speed v_th at which the damper switches"),
        Parameter(
            "transition",
            "m/s",
            "speed either side of v_th over which it switches, at most v_th / 2",
            bounds=(0.0, math.inf),
            default=0.0,
        ),
    ),
    borrows={
        "stance": ("switched_damper.stance", None),
        "flight": ("switched_damper.flight", None),
        "mass": ("inertia.mass", None),
        "gravity": ("gravity.acceleration", 0.0),
        "step": (STEP, 1e-3),
    },
    kernel=kernel,
    acts="modifier",
    size="threshold",
    starts=lambda s: [
        {"threshold": sign * share * s.velocity, "transition": 0.01 * s.velocity}
        for share in (0.3, 1.0)
        for sign in (1.0, -1.0)
    ],
    also_known_as=("late damping", "valve opening speed"),
    family="damping",
    confusable={
        "switched_damper": "shifts the switch instants and the even harmonics, not the damping level alone",
        "viscoelastic_relaxation": "a damper that engages late looks like one that relaxes: vary the amplitude",
    },
    switches=("v", "threshold"),
    reference="Paper, section 4, the switching function s(t)",
)
