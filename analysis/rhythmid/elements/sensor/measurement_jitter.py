"""Measurement jitter: every sample is older than its stamp by its own random delay, uniform on [0, sqrt(12) sigma].

The draw is a function of the stamp and the seed alone, so a run is reproducible; the simulator keeps the samples in
order. The mean, sqrt(3) sigma, acts as measurement delay. The rest is noise of standard deviation sigma |v|. A
simulation with another seed does not reproduce the real draw. So sigma is not estimated by output error, but from
the residual's variance as a function of v^2, and from the roll-off of |H_m| with w.
"""

import math

from rhythmid.elements.element import Element, Parameter
from rhythmid.elements.random_delay import uniform_delay

ELEMENT = Element(
    name="measurement_jitter",
    slot="sensor",
    title="Measurement jitter",
    equation="y_k = ȳ(t_k − τ_k),  τ_k random with standard deviation σ",
    parameters=(
        Parameter("std", "s", "standard deviation σ of the delay", bounds=(0.0, math.inf)),
        Parameter("seed", "1", "seed of the random draw", default=0.0, fixed=True),
    ),
    delay=uniform_delay,
    size="std",
    candidate=False,
    starts=lambda s: [{"std": 0.2 * s.period}],
    also_known_as=("sampling jitter", "aperture jitter", "stamp jitter"),
    family="sampling",
    confusable={
        "measurement_noise": "grows with the speed",
        "command_jitter": "rolls off with ω, not with ω − mω_p",
    },
    reference="T. M. Souders, D. R. Flach, C. Hagwood, G. L. Yang, IEEE TIM 39(1), 1990, 80-85",
)
