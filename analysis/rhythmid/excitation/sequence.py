"""Excitations one after another, and the one function that builds an excitation from its description."""

from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import Field, TypeAdapter

from rhythmid.document import as_node
from rhythmid.excitation.chirp import Chirp
from rhythmid.excitation.excitation import Array, Excitation
from rhythmid.excitation.multisine import Multisine
from rhythmid.excitation.profile import Profile
from rhythmid.excitation.samples import IN_FOLDER, Samples
from rhythmid.excitation.silence import Silence
from rhythmid.validation import validated


class Sequence(Excitation):
    """The `parts` one after another, the whole repeated `repetitions` times; differences between repeats show noise and drift."""

    type: Literal["sequence"] = "sequence"
    parts: Annotated[tuple["AnyExcitation", ...], Field(min_length=1)]
    repetitions: Annotated[int, Field(ge=1)] = 1

    @property
    def duration(self) -> float:
        return self.repetitions * sum(part.duration for part in self.parts)

    @property
    def peak(self) -> float:
        return max(part.peak for part in self.parts)

    def shape(self, time: Array) -> Array:
        once = sum(part.duration for part in self.parts)
        t = time - np.floor(time / once + 1e-12) * once
        value = np.zeros(len(t))
        start = 0.0
        for part in self.parts:
            inside = (t >= start - 1e-9) & (t < start + part.duration - 1e-9)
            value[inside] = part(np.maximum(t[inside] - start, 0.0))
            start += part.duration
        return value


AnyExcitation = Annotated[
    Chirp | Multisine | Profile | Samples | Silence | Sequence, Field(discriminator="type")
]
Sequence.model_rebuild()
_ADAPTER: TypeAdapter[Excitation] = TypeAdapter(AnyExcitation)


def build(spec: Mapping[str, Any], folder: str | Path = ".") -> Excitation:
    """The excitation that `spec` describes: {type: chirp | multisine | profile | samples | silence | sequence, …}.

    File names in it are relative to `folder`. Raises InputError naming the invalid key.
    """
    made = validated(as_node(spec, "excitation"), _ADAPTER, {IN_FOLDER: Path(folder)})
    _ = made.duration  # reads the table of samples
    return made
