"""What a diagnosis says, and how it is written as JSON."""

from dataclasses import dataclass, field
from typing import Any, Literal

Verdict = Literal["consistent", "missing_physics", "unknown_physics", "undecided"]


@dataclass(frozen=True)
class Estimate:
    """A number with its standard deviation and unit; `std` is None where the records do not determine it."""

    value: float
    std: float | None
    unit: str

    def to_dict(self) -> dict[str, Any]:
        return {"value": self.value, "std": self.std, "unit": self.unit}


@dataclass(frozen=True)
class Detection:
    """Whether anything is missing: p-value of the score tests over the whole catalogue, and free-run errors."""

    p_value: float
    nominal_nrmse: float
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
    """An effect that the nominal model lacks, with the probability that this is its name."""

    element: str
    slot: str
    equation: str
    probability: float
    parameters: dict[str, Estimate]


@dataclass(frozen=True)
class Alternative:
    """Another explanation: how much worse its information criterion is, and its error on held-out records."""

    elements: tuple[str, ...]
    delta_bic: float
    heldout_nrmse: float | None


@dataclass(frozen=True)
class FitQuality:
    """Free-run error on the records that the fit saw and on those it did not."""

    train_nrmse: float
    heldout_nrmse: float | None


@dataclass(frozen=True)
class Remainder:
    """What no element explains: the quantity that the leftover force depends on best, and the curve."""

    quantity: str
    explained: float
    p_value: float
    grid: tuple[float, ...]
    force: tuple[float, ...]


@dataclass(frozen=True)
class Diagnosis:
    """The answer to: which physics does the model lack?"""

    verdict: Verdict
    summary: str
    detection: Detection
    location: Location
    missing: tuple[MissingEffect, ...]
    indistinguishable: tuple[tuple[str, ...], ...]
    alternatives: tuple[Alternative, ...]
    refitted_nominal: FitQuality
    augmented: FitQuality
    parameters: dict[str, Estimate]
    delays: dict[str, Any]
    next_experiment: str
    calibration: tuple[str, ...] = ()
    excluded: tuple[str, ...] = ()
    heldout: str = ""
    remainder: Remainder | None = None
    scoring: str = "free run"
    notes: tuple[str, ...] = field(default=())

    def to_dict(self) -> dict[str, Any]:
        """The diagnosis as plain JSON data."""
        return {
            "verdict": self.verdict,
            "summary": self.summary,
            "detection": vars(self.detection),
            "location": {
                "slot": self.location.slot,
                "where": self.location.where,
                "evidence": list(self.location.evidence),
            },
            "missing": [
                {
                    "element": effect.element,
                    "slot": effect.slot,
                    "equation": effect.equation,
                    "probability": effect.probability,
                    "parameters": {name: value.to_dict() for name, value in effect.parameters.items()},
                }
                for effect in self.missing
            ],
            "indistinguishable": [list(group) for group in self.indistinguishable],
            "alternatives": [
                {
                    "elements": list(other.elements),
                    "delta_bic": other.delta_bic,
                    "heldout_nrmse": other.heldout_nrmse,
                }
                for other in self.alternatives
            ],
            "fit": {"refitted_nominal": vars(self.refitted_nominal), "augmented": vars(self.augmented)},
            "parameters": {name: value.to_dict() for name, value in self.parameters.items()},
            "delays": self.delays,
            "next_experiment": self.next_experiment,
            "calibration": list(self.calibration),
            "excluded": list(self.excluded),
            "heldout": self.heldout,
            "remainder": None if self.remainder is None else vars(self.remainder),
            "scoring": self.scoring,
            "notes": list(self.notes),
        }
