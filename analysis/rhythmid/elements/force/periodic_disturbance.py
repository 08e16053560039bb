"""External periodic disturbance: F = a sin(2 pi f t + phi), at a frequency that is not locked to the cycle.

(a, phi) and (-a, phi + pi) are equivalent, so a is kept positive. Over a record of length T the fit in f has one
minimum every 1/T. The starts come from the residual's spectrum, strongest line first; the others cover a guess.
"""

import math

from rhythmid.elements.element import Element, Parameter

# in the longest record; with fewer, a line cannot be distinguished from a phase and a trend
FEWEST_PERIODS = 5


def kernel(x, v, t, f, amplitude, frequency, phase):
    return amplitude * math.sin(2.0 * math.pi * frequency * t + phase)


def starts(scales):
    frequencies = [ratio * scales.natural_frequency for ratio in (0.5, 0.8, 1.2, 1.8, 3.0)]
    if scales.residual_frequency > 0.0:
        frequencies.insert(0, scales.residual_frequency)
    return [
        {"amplitude": 0.01 * scales.force, "frequency": f, "phase": phase}
        for f in frequencies
        for phase in (0.0, 0.5 * math.pi, math.pi, 1.5 * math.pi)  # the amplitude has no sign
    ]


ELEMENT = Element(
    name="periodic_disturbance",
    slot="force",
    title="Periodic disturbance",
    equation="F = a sin(2πf t + φ)",
    parameters=(
        Parameter("amplitude", "N", "amplitude a", bounds=(0.0, math.inf)),
        Parameter("frequency", "Hz", "frequency f", bounds=(0.0, math.inf)),
        Parameter("phase", "rad", "phase φ at t = 0", default=0.0, turn=2.0 * math.pi),
    ),
    kernel=kernel,
    acts="body",
    size="amplitude",
    starts=starts,
    # with fewer periods in a record its three parameters fit any slow function of time; the upper limit is half the
    # sample rate
    ranges=lambda s: {"frequency": (FEWEST_PERIODS / s.duration, 0.5 / s.period)},
    also_known_as=("hum", "rotating imbalance", "external vibration"),
    family="disturbance",
    confusable={
        "position_ripple": "periodic in time, not in position: change the speed",
        "periodic_forcing": "locked to the cycle: its amplitude and phase are nominal parameters",
    },
    reference="Any text on vibrations, e.g. D. J. Inman, Engineering Vibration",
)
