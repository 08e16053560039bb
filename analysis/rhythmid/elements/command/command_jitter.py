"""Command jitter: every command is late by its own random delay, uniform on [0, sqrt(12) sigma], in order.

The draw is a function of the stamp and the seed alone, so a run is reproducible. The mean, sqrt(3) sigma, acts as
input delay. On average the jitter multiplies H_m by its characteristic function at w - m w_p, which is about
1 - sigma^2 (w - m w_p)^2 / 2. A simulation with another seed does not reproduce the real draw. So sigma is not
estimated by output error, but from that roll-off and from output noise that grows with the command's slope.
"""

import math

from rhythmid.elements.element import Element, Parameter
from rhythmid.elements.random_delay import uniform_delay

ELEMENT = Element(
    name="command_jitter",
    slot="command",
    title="Command jitter",
    equation="ū(t) = u(t − τ_k),  τ_k random with standard deviation σ",
    parameters=(
        Parameter("std", "s", "standard deviation σ of the delay", bounds=(0.0, math.inf)),
        Parameter("seed", "1", "seed of the random draw", default=0.0, fixed=True),
    ),
    delay=uniform_delay,
    size="std",
    candidate=False,
    starts=lambda s: [{"std": s.period}],
    also_known_as=("network jitter", "scheduling jitter"),
    family="sampling",
    confusable={
        "measurement_jitter": "rolls off with ω − mω_p, not with ω",
        "command_hold": "its delay is random, not a regular saw-tooth",
    },
    reference="T. M. Souders, D. R. Flach, C. Hagwood, G. L. Yang, IEEE TIM 39(1), 1990, 80-85",
)
