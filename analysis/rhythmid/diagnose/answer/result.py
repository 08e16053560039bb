"""The result types of a diagnosis, and their form as JSON.

The types define the contract: `python -m rhythmid.diagnose.answer.result` prints the JSON schema derived from them.
"""

import json
from dataclasses import dataclass
from typing import Any, Literal

from pydantic import TypeAdapter

from rhythmid.diagnose.case import Untried
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
    """Whether anything is missing.

    `p_value` is that of the score tests over the whole catalogue, None where none were made. Errors are shares of the
    motion or of the effort.
    """

    p_value: float | None
    nominal_nrmse: float | None
    refitted_nominal_nrmse: float
    noise_floor_nrmse: float


@dataclass(frozen=True)
class Location:
    """The deficient slot of the signal path, in one sentence, with the evidence for it."""

    slot: str | None
    where: str
    evidence: tuple[str, ...]


@dataclass(frozen=True)
class MissingEffect:
    """An effect that the nominal model lacks.

    `share` is the part of the mismatch on held-out data that it explains, `probability` that of its name.
    """

    element: str
    slot: str
    equation: str
    share: float
    probability: float
    parameters: dict[str, Estimate]


@dataclass(frozen=True)
class Explanation:
    """One hypothesis with its score on data that its fit has not seen.

    The score is a log predictive density. It comes with its difference to the best hypothesis, the standard error of
    that difference, the probability of the hypothesis, and its error on held-out data.
    """

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
    """Error on the fitted records and on held-out ones, as a share of the motion or of the effort."""

    train_nrmse: float
    heldout_nrmse: float | None

    @property
    def error(self) -> float:
        """The error on held-out records, if there are any."""
        return self.train_nrmse if self.heldout_nrmse is None else self.heldout_nrmse


@dataclass(frozen=True)
class Curve:
    """The remainder as a function of one quantity: a force, or for a sensor error a value in the measurement's unit."""

    grid: tuple[float, ...]
    force: tuple[float, ...]


@dataclass(frozen=True)
class Remainder:
    """What the named effects leave unexplained and a free map predicts.

    Its share of the mismatch, whether that is significant, the quantity on which it depends most and, for a function of
    one quantity, its curve.
    """

    share: float
    significant: bool
    goes_with: str | None
    curve: Curve | None


@dataclass(frozen=True)
class Scored:
    """How records were scored: in free run, in windows or by effort; the bandwidth [Hz] of effort scoring; the reason.

    `averaged` successive samples of the motion count as one, their mean. All errors refer to these means, in which the noise is
    smaller than in single samples.
    """

    kind: ScoringKind
    bandwidth: float | None
    reason: str
    averaged: int


def settled(verdict: Verdict, indistinguishable: tuple[tuple[str, ...], ...], unnamed: bool) -> bool:
    """Whether an answer needs no further record: it names effects, no other names explain the records as well, and the chosen
    hypothesis has no effects that are too uncertain to be named (`unnamed`)."""
    return verdict == "missing_physics" and not indistinguishable and not unnamed


@dataclass(frozen=True)
class Diagnosis:
    """The answer to: which physics does the model lack?

    `chosen` are the elements of the hypothesis that `augmented`, `parameters` and `remainder` describe; it is empty where
    that is the nominal model. `families` are those of its effects: the family may be certain where the law is not.
    """

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
    notes: tuple[str, ...] = ()
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
        """Whether the answer needs no further record."""
        effects = [label for label in self.chosen if "." not in label]  # a freed value is no effect
        return settled(self.verdict, self.indistinguishable, len(effects) > len(self.missing))

    def to_dict(self) -> dict[str, Any]:
        """The diagnosis as plain JSON data; a number that is not finite is null."""
        return json.loads(ANSWER.dump_json(self))


ANSWER = TypeAdapter(Diagnosis)


def schema() -> dict[str, Any]:
    """JSON schema of `to_dict`; any number may be null there, because a number that is not finite is written as null."""
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
