"""Additive measurement noise: white, or first-order coloured (autoregressive) with a correlation coefficient."""

import math

import numpy as np

from rhythmid.elements.element import Element, Parameter


def sampler(rng, std, correlation):
    from scipy.signal import lfilter  # slow to load, and every program loads the catalogue

    memory = np.array([std * rng.standard_normal() * correlation])
    innovation = std * math.sqrt(1.0 - correlation**2)

    def noisy(stamps, samples):
        nonlocal memory
        noise, memory = lfilter(
            [1.0], [1.0, -correlation], innovation * rng.standard_normal(len(samples)), zi=memory
        )
        return samples + noise

    return noisy


ELEMENT = Element(
    name="measurement_noise",
    slot="sensor",
    title="Measurement noise",
    equation="y_k = ȳ_k + n_k,  n_k = ρ n_{k−1} + √(1−ρ²) σ ε_k",
    parameters=(
        Parameter("std", "m", "standard deviation σ", bounds=(0.0, math.inf), default=0.0),
        Parameter(
            "correlation", "1", "correlation ρ from sample to sample", bounds=(0.0, 0.9999), default=0.0
        ),
    ),
    sampler=sampler,
    size="std",
    candidate=False,
    confusable={"sensor_quantisation": "histogram of the differences between samples"},
    reference="Any text on time series; first-order autoregressive process",
)
