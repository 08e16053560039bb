"""Sensor quantisation: samples are rounded to whole steps q (an encoder's counts, a converter's bits).

While the motion crosses many steps it is white noise of variance q^2 / 12 without bias. It shows in the differences
between samples, which are whole multiples of q, but not in a noise-free simulation.
"""

from math import inf

import numpy as np

from rhythmid.elements.element import Element, Parameter


def sampler(rng, resolution):
    def rounded(stamps, samples):
        return samples if resolution <= 0.0 else resolution * np.round(samples / resolution)

    return rounded


ELEMENT = Element(
    name="sensor_quantisation",
    slot="sensor",
    title="Sensor quantisation",
    equation="y_k → q round(y_k / q)",
    parameters=(Parameter("resolution", "m", "step q", bounds=(0.0, inf)),),
    sampler=sampler,
    size="resolution",
    candidate=False,
    starts=lambda s: [{"resolution": 0.05 * s.position}],
    also_known_as=("encoder resolution", "least significant bit"),
    family="sampling",
    confusable={"measurement_noise": "differences between samples are whole multiples of q"},
    reference="B. Widrow, I. Kollár, Quantization Noise, Cambridge University Press, 2008",
)
