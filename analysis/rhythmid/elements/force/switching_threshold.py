"""Switching threshold: the direction-switched damper turns on at v = v_th instead of v = 0.

As an addition to the nominal damper: F = -(c_s - c_f) v ([v > v_th] - [v > 0]). The force now jumps at the switch.
Both brackets are smoothed alike, so that the effect vanishes exactly at v_th = 0 and can be differentiated with respect
to v_th: [v > a] = 4/3 s((v - a) / w) - 1/3 s((v - a) / 2w) with s(z) = (1 + tanh z) / 2. The second moments of the two
cancel, so that the motion depends on w to the fourth order only, and w need not be small beside v_th.
The effect grows with the square of small thresholds: fits need starts of physical size.
"""

import math

from rhythmid.elements.element import Element, Parameter


def kernel(x, v, t, f, threshold, transition, stance, flight):
    narrow = 1.0 / max(transition, 1e-300)
    wide = 0.5 * narrow
    late = (math.tanh((v - threshold) * narrow) - math.tanh(v * narrow)) * 2.0 / 3.0
    late -= (math.tanh((v - threshold) * wide) - math.tanh(v * wide)) / 6.0
    return -(stance - flight) * v * late


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
            "speed w over which it switches",
            bounds=(0.0, math.inf),
            default=1e-3,
            fixed=True,
        ),
    ),
    borrows={"stance": ("switched_damper.stance", None), "flight": ("switched_damper.flight", None)},
    kernel=kernel,
    size="threshold",
    starts=lambda s: [
        {"threshold": sign * 0.3 * s.velocity, "transition": 0.005 * s.velocity} for sign in (1.0, -1.0)
    ],
    also_known_as=("late damping", "valve opening speed"),
    family="damping",
    confusable={
        "switched_damper": "shifts the switch instants and the even harmonics, not the damping level alone",
        "viscoelastic_relaxation": "a damper that engages late looks like one that relaxes: vary the amplitude",
    },
    reference="Paper, section 4, the switching function s(t)",
)
