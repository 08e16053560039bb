"""No command: the limit cycle alone, a free decay, or a pause in a sequence."""

from typing import Annotated, Literal

import numpy as np
from pydantic import Field

from rhythmid.excitation.excitation import Array, Excitation


class Silence(Excitation):
    """u(t) = 0 for `length` [s]."""

    type: Literal["silence"] = "silence"
    length: Annotated[float, Field(gt=0)]

    @property
    def duration(self) -> float:
        return self.length

    def shape(self, time: Array) -> Array:
        return np.zeros(len(time))
