"""What a diagnosis says, and how it is written as JSON.

The types are the contract: `python -m rhythmid.diagnose.answer.result` prints the JSON schema that follows from them.
"""

import json
from dataclasses import dataclass, field
from typing import Any, Literal

from pydantic import TypeAdapter

from rhythmid.diagnose.family import MissingFamily
from rhythmid.diagnose.hypothesis import Kind, ScoringKind, Verdict
from rhythmid.diagnose.rejections import Rejection


@dataclass(frozen=True)
class Estimate:
    """A number with its standard deviation and unit; `std` is None where the records do not determine it."""

    value: float
    std: float | None
    unit: str


@dataclass(frozen=True)
class Detection:
    """Whether anything is missing: p-value of the score tests over the whole catalogue (None where none were made), and errors
    as shares of the motion or of the effort."""

    p_value: float | None
    nominal_nrmse: float | None
    refitted_nominal_nrmse: float
    noise_floor_nrmse: float


@dataclass(frozen=True)
class Location:
    """Which slot of the signal path is deficient, in one sentence, with what speaks for it."""

    slot: str | None
    where: str
    evidence: tuple[str, ...]


@dataclass(frozen=True)
class MissingEffect:
    """An effect that the nominal model lacks: the share of the mismatch on held-out data that it explains, and the probability
    that this is its name."""

    element: str
    slot: str
    equation: str
    share: float
    probability: float
    parameters: dict[str, Estimate]


@dataclass(frozen=True)
class Explanation:
    """One hypothesis: the log density with which it predicts data that its fit has not seen, how much less that is than the best
    one's with the standard error of the difference, its probability, and its error on held-out data."""

    elements: tuple[str, ...]
    kind: Kind
    score: float
    score_difference: float
    standard_error: float
    probability: float
    heldout_nrmse: float | None


@dataclass(frozen=True)
class Alternative:
    """Another explanation by effects: how much worse its information criterion is, and its error on held-out data."""

    elements: tuple[str, ...]
    delta_bic: float
    heldout_nrmse: float | None


@dataclass(frozen=True)
class FitQuality:
    """Error on the records that the fit saw and on those it did not, as a share of the motion or of the effort."""

    train_nrmse: float
    heldout_nrmse: float | None


@dataclass(frozen=True)
class Curve:
    """A function of one quantity: what is left as a force, or for a sensor error in the measurement's unit, over the quantity."""

    grid: tuple[float, ...]
    force: tuple[float, ...]


@dataclass(frozen=True)
class Remainder:
    """What the named effects leave and a free map predicts: its share of the mismatch, whether that is more than chance, the
    quantity that it depends on most and, for a function of one quantity, its curve."""

    share: float
    significant: bool
    goes_with: str | None
    curve: Curve | None


@dataclass(frozen=True)
class Scored:
    """How records were scored: in free run, in windows or by effort; the bandwidth of effort scoring [Hz]; and why."""

    kind: ScoringKind
    bandwidth: float | None
    reason: str


@dataclass(frozen=True)
class Untried:
    """A candidate that was not tried, or what else was not, and the reason."""

    name: str
    reason: str


def settled(verdict: Verdict, indistinguishable: tuple[tuple[str, ...], ...]) -> bool:
    """Whether nothing has to be recorded to make sure of an answer: it names effects, and no others might stand in their place."""
    return verdict == "missing_physics" and not indistinguishable


@dataclass(frozen=True)
class Diagnosis:
    """The answer to: which physics does the model lack? `chosen` are the elements of the hypothesis that `augmented`, `parameters` and
    `remainder` are of, nothing where that is the nominal model. `families` are those of its effects: the kind of what is missing may be
    certain where the law is not."""

    verdict: Verdict
    summary: str
    detection: Detection
    location: Location
    missing: tuple[MissingEffect, ...]
    joint_probability: float
    indistinguishable: tuple[tuple[str, ...], ...]
    alternatives: tuple[Alternative, ...]
    hypotheses: tuple[Explanation, ...]
    rejections: tuple[Rejection, ...]
    remainder: Remainder
    fit: dict[Literal["refitted_nominal", "augmented"], FitQuality]
    parameters: dict[str, Estimate]
    delays: dict[str, Any]
    next_experiment: str
    scoring: Scored
    assumptions: tuple[str, ...] = ()
    calibration: tuple[str, ...] = ()
    excluded: tuple[Untried, ...] = ()
    heldout: str = ""
    notes: tuple[str, ...] = field(default=())
    chosen: tuple[str, ...] = ()
    families: tuple[MissingFamily, ...] = ()

    @property
    def refitted_nominal(self) -> FitQuality:
        """Error of the refitted nominal model."""
        return self.fit["refitted_nominal"]

    @property
    def augmented(self) -> FitQuality:
        """Error of the model with the named effects."""
        return self.fit["augmented"]

    @property
    def settled(self) -> bool:
        """Whether nothing has to be recorded to make sure of it."""
        return settled(self.verdict, self.indistinguishable)

    def to_dict(self) -> dict[str, Any]:
        """The diagnosis as plain JSON data; a number that is not finite is null."""
        return json.loads(ANSWER.dump_json(self))


ANSWER = TypeAdapter(Diagnosis)


def schema() -> dict[str, Any]:
    """JSON schema of `to_dict`: any number may be null there, for one that is not finite."""
    return _nullable(ANSWER.json_schema(mode="serialization"))


def _nullable(part: Any) -> Any:
    """A part of a schema in which every number may be null."""
    if isinstance(part, list):
        return [_nullable(one) for one in part]
    if not isinstance(part, dict):
        return part
    made = {key: _nullable(value) for key, value in part.items()}
    return made | {"type": ["number", "null"]} if made.get("type") == "number" else made


if __name__ == "__main__":
    print(json.dumps(schema(), indent=2, ensure_ascii=False))
