"""Second mode: a mass m_2 attached to the first by a spring and a damper (a loose part, a payload, a flexible mount).

F = k_2 (q - x) + c_2 (dq/dt - v), m_2 d2q/dt2 = -F, with k_2 = m_2 w^2, c_2 = 2 zeta m_2 w, w = 2 pi f_2. q is the
attached mass's position, measured from its rest relative to the first mass. Its weight is a constant force, which
the spring's rest length absorbs. A mode too fast for the integration step (w h > 1) is slowed down to w = 1 / h;
there it is still an added mass. A fit in f_2 has local minima, so it needs a grid of starts.
"""

import math

from rhythmid.elements.element import STEP, Element, Parameter


def kernel(x, v, t, f, mass, frequency, damping_ratio, step, position, velocity):
    omega = min(2.0 * math.pi * frequency, 1.0 / step)
    pull = omega * omega * (position - x) + 2.0 * damping_ratio * omega * (
        velocity - v
    )  # per unit of attached mass
    return mass * pull, velocity, -pull


RATIOS = (
    0.7,
    1.0,
    1.4,
    2.0,
    2.4,
    2.8,
    3.4,
    4.0,
    4.8,
    5.6,
)  # ratios of the mode's frequency to that of the mass on its spring
DAMPING_RATIOS = (0.1, 0.01)  # of a joint or a payload, and of a metal structure
SHARE = 0.03  # of the first mass
# ratios to the strongest remaining line: the mode is next to the line that it causes
FACTORS_OF_LINE = (1.0, 0.97, 1.03)


def starts(scales):
    """At the strongest line of the residual, and on a grid; lightly damped ones only near the line, where they are
    visible."""
    line = scales.residual_frequency
    found = [(ratio * line, damping) for damping in DAMPING_RATIOS for ratio in FACTORS_OF_LINE if line > 0.0]
    found += [(ratio * scales.natural_frequency, DAMPING_RATIOS[0]) for ratio in RATIOS]
    return [
        {"mass": SHARE * scales.mass, "frequency": frequency, "damping_ratio": damping}
        for frequency, damping in found
    ]


ELEMENT = Element(
    name="second_mode",
    slot="force",
    title="Second mode",
    equation="F = k₂ (q − x) + c₂ (q̇ − v),  m₂ q̈ = −F,  k₂ = m₂ (2πf₂)²,  c₂ = 2ζ₂ m₂ 2πf₂",
    parameters=(
        Parameter("mass", "kg", "attached mass m₂", bounds=(0.0, math.inf)),
        Parameter(
            "frequency",
            "Hz",
            "frequency f₂ of the attached mass with the first one held",
            bounds=(0.0, math.inf),
        ),
        Parameter("damping_ratio", "1", "its damping ratio ζ₂", bounds=(0.0, 2.0), default=0.05),
    ),
    borrows={"step": (STEP, 1e-3)},
    kernel=kernel,
    acts="body",
    states=("position", "velocity"),
    initial=lambda x, v, f, mass, frequency, damping_ratio, step: (x, v),
    size="mass",
    width="damping_ratio",
    starts=starts,
    # slower than the motion it is a mass at rest with a viscous damper; slower than a record it is a force set by
    # its initial state; faster than the samples it is an added mass; overdamped it is a relaxation
    ranges=lambda s: {
        "frequency": (max(0.3 * min(s.natural_frequency, s.frequency), 1.0 / s.duration), 0.5 / s.period),
        "damping_ratio": (0.0, 1.0),
    },
    also_known_as=("attached mass", "tuned mass", "structural resonance", "flexible payload"),
    family="resonance",
    confusable={
        "sensor_lag": "far below f₂ only: excite around and above it",
        "viscoelastic_relaxation": "an overdamped mode",
    },
    reference="J. P. Den Hartog, Mechanical Vibrations, 4th ed., 1956, section 3.2",
)
