"""The answer held against the opened truth."""

import math
from dataclasses import dataclass
from typing import Any, Literal

from rhythmid.elements.catalogue import Catalogue

Outcome = Literal["exact", "family", "wrong", "unknown", "undecided", "consistent", "failed"]
FAMILY = 2  # members that a declared family may have
ANGLES = ("phase",)
MACHINE = {
    "linear_spring.stiffness": "stiffness",
    "linear_spring.rest_length": "rest_length",
    "switched_damper.stance": "damping",
}
DELAYS = {"input_delay.delay": "input_delay", "measurement_delay.delay": "measurement_delay"}
NO_SINGLE_DELAY = {"command_hold", "input_delay_drift", "delay_drift", "clock_skew"}


@dataclass(frozen=True)
class Estimated:
    """A parameter's true value, its estimate and standard deviation."""

    name: str
    true: float
    value: float
    std: float

    @property
    def deviation(self) -> float:
        """Error in standard deviations."""
        error = self.value - self.true
        if self.name.rsplit(".", 1)[-1] in ANGLES:
            error = math.remainder(error, 2.0 * math.pi)
        return error / self.std


@dataclass(frozen=True)
class Score:
    """How one case came out.

    `outcome` exact: named just what was concealed; family: named, or declared indistinguishable from what was named in a
    family of two; wrong: something else named. `heldout` is the held-out error over the noise floor.
    """

    case: str
    kind: str
    true: tuple[str, ...]
    named: tuple[str, ...]
    families: tuple[tuple[str, ...], ...]
    verdict: str
    outcome: Outcome
    slot_right: bool
    ratio: float
    faintest: float
    noise: str
    nominal_error: float
    heldout: float | None
    effects: tuple[Estimated, ...]
    machine: tuple[Estimated, ...]
    seconds: float
    processor_seconds: float
    absent: tuple[str, ...]
    failure: str

    @property
    def honest(self) -> bool:
        """Whether an effect that the catalogue lacks was not given a confident wrong name."""
        return self.outcome in ("unknown", "undecided") or (
            self.verdict == "missing_physics" and bool(self.families)
        )

    @property
    def false_alarm(self) -> bool:
        """Whether something was claimed to be missing."""
        return self.verdict in ("missing_physics", "unknown_physics")

    @property
    def right_within_family(self) -> bool:
        return self.outcome in ("exact", "family")


def score(truth: dict[str, Any], answer: dict[str, Any], catalogue: Catalogue) -> Score:
    """Compare an answer with the truth; the whole `catalogue` says in which slot an effect is."""
    concealed = truth["concealed"]
    true = tuple(sorted(one["effect"]["name"] for one in concealed))
    named = tuple(sorted(effect["element"] for effect in answer.get("missing", ())))
    families = tuple(tuple(group) for group in answer.get("indistinguishable", ()))
    outcome = _outcome(true, named, families, answer)
    slots = {catalogue[name].slot for name in true}
    if len(true) == 1:
        said = {(answer.get("location") or {}).get("slot")}
    else:
        said = {effect["slot"] for effect in answer.get("missing", ())}
    return Score(
        case=truth["name"],
        kind=truth["kind"],
        true=true,
        named=named,
        families=families,
        verdict=answer.get("verdict", "failed"),
        outcome=outcome,
        slot_right=bool(true) and said == slots,
        ratio=truth["ratio"],
        faintest=min((one["ratio"] for one in concealed), default=0.0),
        noise=truth["noise"]["kind"],
        nominal_error=truth["nominal_error"],
        heldout=_heldout(truth, answer),
        effects=_effect_estimates(truth, answer) if outcome == "exact" else (),
        machine=_machine_estimates(truth, answer, true) if outcome == "exact" or true == named == () else (),
        seconds=answer["seconds"],
        processor_seconds=answer["processor_seconds"],
        absent=tuple(truth["absent"]),
        failure=answer.get("failure", ""),
    )


def _outcome(
    true: tuple[str, ...],
    named: tuple[str, ...],
    families: tuple[tuple[str, ...], ...],
    answer: dict[str, Any],
) -> Outcome:
    if "verdict" not in answer:
        return "failed"
    plain: dict[str, Outcome] = {
        "consistent": "consistent", "undecided": "undecided", "unknown_physics": "unknown",
    }  # fmt: skip
    if answer["verdict"] in plain:
        return plain[answer["verdict"]]
    if named == true:
        return "exact"
    small = [set(group) for group in families if len(group) <= FAMILY]
    open_names = list(named)
    for name in true:
        match = next((n for n in open_names if n == name), None) or next(
            (n for n in open_names if any({n, name} <= group for group in small)), None
        )
        if match is None:
            return "wrong"
        open_names.remove(match)
    return "wrong" if open_names else "family"


def _heldout(truth: dict[str, Any], answer: dict[str, Any]) -> float | None:
    error = ((answer.get("fit") or {}).get("augmented") or {}).get("heldout_nrmse")
    floor = truth["floors"].get(str(answer.get("block")))
    return error / floor if error is not None and floor else None


def _estimated(name: str, true: float, given: dict[str, Any] | None) -> list[Estimated]:
    if not given or not given["std"] or not math.isfinite(given["std"]):
        return []
    return [Estimated(name, true, given["value"], given["std"])]


def _effect_estimates(truth: dict[str, Any], answer: dict[str, Any]) -> tuple[Estimated, ...]:
    """Parameters that both descriptions of an effect have; how sharply a friction turns is nobody's parameter."""
    found: list[Estimated] = []
    for one in truth["concealed"]:
        name = one["effect"]["name"]
        given = next(effect["parameters"] for effect in answer["missing"] if effect["element"] == name)
        for parameter, value in one["effect"]["parameters"].items():
            found += _estimated(f"{name}.{parameter}", value, given.get(parameter))
    return tuple(found)


def _machine_estimates(
    truth: dict[str, Any], answer: dict[str, Any], true: tuple[str, ...]
) -> tuple[Estimated, ...]:
    given = answer.get("parameters", {})
    found: list[Estimated] = []
    for name, attribute in MACHINE.items():
        found += _estimated(name, truth["machine"][attribute], given.get(name))
    if not NO_SINGLE_DELAY & set(true):
        for name, attribute in DELAYS.items():
            found += _estimated(name, truth[attribute], given.get(name))
    return tuple(found)
