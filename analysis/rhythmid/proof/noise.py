"""Errors added by sensors and loggers: noise of three kinds, rounding, jittered stamps and rare outliers."""

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from rhythmid.proof.machines.rig import log_uniform

Array = NDArray[np.float64]
NoiseKind = Literal["white", "coloured", "quantised"]
NOISES: tuple[NoiseKind, ...] = ("white", "coloured", "quantised")
FARTHEST_STAMP = 0.4  # largest jitter of a stamp [sample periods]; stamps stay in order


@dataclass(frozen=True)
class Noise:
    """Measurement noise of rms `std` [m]: white, coloured (first-order autoregressive), or with rounding to `step` [m]."""

    kind: NoiseKind
    std: float
    correlation: float = 0.0
    step: float = 0.0

    def corrupt(self, clean: Array, rng: np.random.Generator) -> Array:
        """The samples with noise."""
        white = rng.standard_normal(len(clean))
        if self.kind == "quantised":
            spread = math.sqrt(self.std**2 - self.step**2 / 12.0)
            return self.step * np.round((clean + spread * white) / self.step)
        if self.kind == "coloured":
            return clean + self.std * coloured(white, self.correlation)
        return clean + self.std * white


def coloured(white: Array, correlation: float) -> Array:
    """First-order autoregressive noise of rms 1 made of white noise of rms 1."""
    made = np.empty(len(white))
    level = white[0]
    innovation = math.sqrt(1.0 - correlation**2)
    for k, draw in enumerate(white):
        level = correlation * level + innovation * draw if k else draw
        made[k] = level
    return made


@dataclass(frozen=True)
class Log:
    """Errors of a log beyond the sensor's noise; none by default.

    Stamps have a jitter of `jitter` sample periods rms. The measurement is rounded to `step` [m]. A share `outliers` of its samples
    is wrong by `size` [m] or up to three times as much.
    """

    jitter: float = 0.0
    step: float = 0.0
    outliers: float = 0.0
    size: float = 0.0

    def written(self, samples: Array, rng: np.random.Generator) -> Array:
        """The samples as logged."""
        if not (self.step or self.outliers):
            return samples
        hit = rng.random(len(samples)) < self.outliers
        sign = rng.choice([-1.0, 1.0], len(samples))
        off = np.where(hit, sign * self.size * rng.uniform(1.0, 3.0, len(samples)), 0.0)
        made = samples + off
        return self.step * np.round(made / self.step) if self.step else made

    def stamped(self, stamps: Array, period: float, rng: np.random.Generator) -> Array:
        """The stamps as logged; `period` [s] is that of the samples."""
        if not self.jitter:
            return stamps
        moved = self.jitter * rng.standard_normal(len(stamps))
        return stamps + period * np.clip(moved, -FARTHEST_STAMP, FARTHEST_STAMP)


def draw_noise(
    rng: np.random.Generator,
    size: float,
    kind: NoiseKind | None = None,
    share: tuple[float, float] = (0.008, 0.03),
) -> Noise:
    """Noise with an rms that is a `share` of `size` [m], by default 0.8 to 3 %."""
    std = size * log_uniform(rng, *share)
    kind = kind or NOISES[int(rng.choice(len(NOISES), p=[0.5, 0.3, 0.2]))]
    if kind == "coloured":
        return Noise("coloured", std, correlation=rng.uniform(0.5, 0.9))
    if kind == "quantised":
        return Noise("quantised", std, step=std * rng.uniform(1.0, 3.0))
    return Noise("white", std)


def draw_log(rng: np.random.Generator, noise: Noise) -> Log:
    """Log errors for a measurement with this noise."""
    return Log(
        jitter=log_uniform(rng, 0.02, 0.15),
        step=noise.std * rng.uniform(0.3, 2.0),
        outliers=log_uniform(rng, 1e-4, 1e-3),
        size=noise.std * log_uniform(rng, 10.0, 50.0),
    )
