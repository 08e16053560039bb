"""latency.yaml: the identified delays and model in a small file that a controller loads.

    delays: {input: {value: 0.04, std: 1.7e-05}, measurement: {…}, sum: {…}, separable: true, assumption: …}
    model: the identified model, as in model.yaml, delays included

All times are in seconds. A delay that is not identifiable separately is null; the sum is always given. A predictor
needs only the sum: a state measured now is `measurement` old, and a command given now acts `input` later.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import yaml
from pydantic import TypeAdapter

from rhythmid.document import read
from rhythmid.errors import InputError
from rhythmid.identify.identification import Estimate, Identification
from rhythmid.model import Model
from rhythmid.output import write_text
from rhythmid.validation import Number, validated


@dataclass(frozen=True)
class Latency:
    """Delays [s] of the command and measurement paths, None where only their sum is known, and the model."""

    input: float | None
    measurement: float | None
    sum: float
    sum_std: float | None
    model: Model

    @classmethod
    def load(cls, path: str | Path) -> "Latency":
        """The latency file at `path`. Raises InputError when the file is not a latency file."""
        document = read(path)
        if not isinstance(document.value, Mapping) or not {"delays", "model"} <= document.value.keys():
            raise InputError(f"{path}: not a latency file; `rhythmid identify --save` writes one")
        delays = validated(document.at("delays"), _DELAYS)
        model = Model.from_document(document.at("model"))
        return cls(delays.input.value, delays.measurement.value, delays.sum.value, delays.sum.std, model)


@dataclass(frozen=True)
class _Delay:
    value: Number | None
    std: Number | None = None


@dataclass(frozen=True)
class _Sum:
    value: Number
    std: Number | None = None


@dataclass(frozen=True)
class _Delays:
    input: _Delay
    measurement: _Delay
    sum: _Sum


_DELAYS: TypeAdapter[_Delays] = TypeAdapter(_Delays)


def save_latency(found: Identification, path: Path) -> None:
    """Write the delays and the model of an identification. Raises InputError when the sum of the delays is unknown."""
    if found.delays.sum.value is None:
        raise InputError(
            "no latency to save: the records show no command, so the sum of the delays is unknown"
        )

    def entry(estimate: Estimate) -> dict[str, float | None]:
        return {
            "value": None if estimate.value is None else float(estimate.value),
            "std": None if estimate.std is None else float(estimate.std),
        }

    delays = found.delays
    content = {
        "delays": {
            "input": entry(delays.input),
            "measurement": entry(delays.measurement),
            "sum": entry(delays.sum),
            "unit": "s",
            "separable": delays.separable,
            "assumption": delays.assumption,
        },
        "model": yaml.safe_load(found.model.to_yaml()),
    }
    write_text(path, yaml.safe_dump(content, sort_keys=False, allow_unicode=True, width=110))
