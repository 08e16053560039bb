"""A command given by its corner points: bias, steps, a release, slow ramps."""

from typing import Annotated, Literal

import numpy as np
from pydantic import Field, model_validator

from rhythmid.excitation.excitation import Array, Excitation


class Profile(Excitation):
    """u(t) through `points` [[time s, force N], …]: `step` holds each value until the next point, `ramp` interpolates linearly."""

    type: Literal["profile"] = "profile"
    points: Annotated[tuple[tuple[float, float], ...], Field(min_length=1)]
    join: Literal["step", "ramp"] = "step"
    length: Annotated[float, Field(gt=0)]

    @model_validator(mode="after")
    def _times_increase(self) -> "Profile":
        times = [t for t, _ in self.points]
        if any(b <= a for a, b in zip(times, times[1:])):
            raise ValueError("points: the times must increase")
        return self

    @property
    def duration(self) -> float:
        return self.length

    def shape(self, time: Array) -> Array:
        times = np.array([t for t, _ in self.points])
        values = np.array([u for _, u in self.points])
        if self.join == "ramp":
            return np.interp(time, times, values, left=0.0)
        index = np.searchsorted(times, time + 1e-9, side="right") - 1
        return np.where(index >= 0, values[np.maximum(index, 0)], 0.0)
