"""Score of an answer against the opened truth."""

import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal

from rhythmid.diagnose.alternatives import moved_name
from rhythmid.elements.catalogue import Catalogue
from rhythmid.elements.element import Element
from rhythmid.proof.equations import FOREIGN
from rhythmid.proof.machines.designs import DESIGNS
from rhythmid.proof.sizes import EQUIVALENT

Outcome = Literal["exact", "family", "wrong", "unknown", "undecided", "consistent", "failed"]
FAMILY = 2  # largest number of members of a declared family
ANGLES = ("phase",)
SURE = 0.8  # probability from which an answer states a name
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
class Stated:
    """A name stated by an answer, with its probability.

    `right` is true in three cases. The name was concealed. The answer declares it indistinguishable from a concealed effect,
    in a family of two or because the name is its special case. Or it names clutter that was present, or a law of the same
    family as such clutter, for much of which the catalogue has no name. `related`: the name is of the same family as a
    concealed effect.
    """

    name: str
    probability: float
    right: bool
    related: bool = False


@dataclass(frozen=True)
class Score:
    """The score of one case.

    `outcome` is "exact" if all concealed effects were named, and besides them only clutter that was present or its relatives. It is
    "family" if they were named or declared indistinguishable from a named effect, in a family of two or as the richer law, or if the
    answer states their family and leaves open only laws that no record of the machine separates. It is "wrong" if anything else was named. `dominant_first`: the name with the largest share was concealed. `heldout` is the ratio of the
    held-out error to the noise floor; None where the effort was scored or recorded. `kinds` are the families reported as missing, the
    largest share first.
    """

    case: str
    kind: str
    design: str
    cluttered: bool
    true: tuple[str, ...]
    clutter: tuple[str, ...]
    named: tuple[str, ...]
    families: tuple[tuple[str, ...], ...]
    stated: tuple[Stated, ...]
    dominant_first: bool
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
    kinds: tuple[Stated, ...] = ()

    @property
    def kinds_stated(self) -> tuple[Stated, ...]:
        """Families that the answer states."""
        return tuple(one for one in self.kinds if one.probability >= SURE)

    @property
    def kind_right(self) -> bool:
        """Whether the family with the largest share is stated, and an effect of it was concealed."""
        return bool(self.kinds) and self.kinds[0].probability >= SURE and self.kinds[0].related

    @property
    def stated_wrong(self) -> tuple[str, ...]:
        """Names that the answer states and that are wrong."""
        return tuple(one.name for one in self.stated if one.probability >= SURE and not one.right)

    @property
    def stated_unrelated(self) -> tuple[str, ...]:
        """Those of these names whose family is that of no concealed effect."""
        return tuple(
            one.name for one in self.stated if one.probability >= SURE and not (one.right or one.related)
        )

    @property
    def group(self) -> str:
        """The row of the score card to which the case belongs."""
        return f"{self.kind}, cluttered" if self.cluttered else self.kind

    @property
    def honest(self) -> bool:
        """Whether no wrong name was stated with confidence for an effect that the catalogue lacks."""
        return self.outcome in ("unknown", "undecided") or (
            self.verdict == "missing_physics" and bool(self.families)
        )

    @property
    def false_alarm(self) -> bool:
        """Whether missing physics was reported."""
        return self.verdict in ("missing_physics", "unknown_physics")

    @property
    def right_within_family(self) -> bool:
        return self.outcome in ("exact", "family")


def score(truth: dict[str, Any], answer: dict[str, Any], catalogue: Catalogue) -> Score:
    """Compare an answer with the truth; the complete `catalogue` gives the slot of each effect."""
    concealed = truth["concealed"]
    true = tuple(sorted(one["effect"]["name"] for one in concealed))
    named = tuple(sorted(effect["element"] for effect in answer.get("missing", ())))
    families = tuple(tuple(group) for group in answer.get("indistinguishable", ()))
    clutter = tuple(sorted(one["effect"]["name"] for one in truth["clutter"]))
    kin = _kin_of(clutter, catalogue)
    stands_for = {name: _declared(name, families, catalogue) for name in named}
    alike = (*EQUIVALENT, DESIGNS[truth["design"]].alike)
    outcome = _outcome(true, stands_for, answer, kin, _left_open(answer, alike))
    if outcome == "undecided" and _all_alike(true, families, alike):
        outcome = "family"
    ranked = _ranked(answer)
    said = {effect["slot"] for effect in answer.get("missing", ())}
    if len(true) == 1:
        said = {(answer.get("location") or {}).get("slot")}
    return Score(
        case=truth["name"],
        kind=truth["kind"],
        design=truth["design"],
        cluttered=truth["cluttered"],
        true=true,
        clutter=clutter,
        named=named,
        families=families,
        stated=tuple(
            Stated(
                effect["element"],
                float(effect["probability"]),
                effect["element"] in kin or bool(stands_for[effect["element"]] & set(true)),
                effect["element"] in _kin_of(true, catalogue),
            )
            for effect in ranked
            if effect.get("probability") is not None
        ),
        dominant_first=bool(ranked) and bool(stands_for[ranked[0]["element"]] & set(true)),
        verdict=answer.get("verdict", "failed"),
        outcome=outcome,
        slot_right=bool(true) and said == {catalogue[name].slot for name in true},
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
        kinds=_kinds(answer, true, clutter, catalogue),
    )


def _kinds(
    answer: dict[str, Any], true: Sequence[str], clutter: Sequence[str], catalogue: Catalogue
) -> tuple[Stated, ...]:
    """Families reported as missing: right if a concealed effect or clutter is of the family, related if a concealed one is."""
    hidden, there = _families_of(true, catalogue), _families_of((*true, *clutter), catalogue)
    return tuple(
        Stated(one["family"], float(one["probability"]), one["family"] in there, one["family"] in hidden)
        for one in answer.get("families", ())
    )


def _families_of(names: Sequence[str], catalogue: Catalogue) -> set[str]:
    """Families of effects; some of the effects are not in the catalogue."""
    return {FOREIGN[name] if name in FOREIGN else catalogue[name].family for name in names}


def _ranked(answer: dict[str, Any]) -> list[dict[str, Any]]:
    """The effects reported as missing, sorted by the share that they explain if all shares are given."""
    missing = list(answer.get("missing", ()))
    if all(effect.get("share") is not None for effect in missing):
        missing.sort(key=lambda effect: -effect["share"])
    return missing


def _all_alike(
    true: tuple[str, ...], families: tuple[tuple[str, ...], ...], alike: Sequence[frozenset[str]]
) -> bool:
    """Whether an answer only leaves open effects that no record of the machine separates, the true ones among them."""
    return bool(true) and any(set(true) <= set(group) <= same for group in families for same in alike)


def _left_open(answer: dict[str, Any], alike: Sequence[frozenset[str]]) -> set[str]:
    """Effects whose family an answer states, and of whose laws it leaves open only those that no record of the machine separates."""
    stated = (set(one["laws"]) for one in answer.get("families", ()) if one["probability"] >= SURE)
    return {name for laws in stated if any(laws <= same for same in alike) for name in laws}


def _declared(name: str, families: tuple[tuple[str, ...], ...], catalogue: Catalogue) -> set[str]:
    """The effects for which a name counts.

    They are the effect itself; the element of the slot to which a law of its family was moved, which is the same law; and, if the
    answer declares them indistinguishable, the other member of a family of two and richer laws that contain it.
    """
    groups = [set(group) for group in families if name in group]
    richer = set(catalogue[name].special_case_of) if name in catalogue else set()
    same = {one.name for one in catalogue.values() for kin in catalogue.values() if _moved_to(one, kin, name)}
    return {name, *same}.union(*(group if len(group) <= FAMILY else group & richer for group in groups))


def _moved_to(one: Element, kin: Element, name: str) -> bool:
    """Whether `name` is the name of `kin` moved to the slot of `one`, where both have the same family and parameters."""
    parameters = [[(parameter.name, parameter.unit) for parameter in each.parameters] for each in (one, kin)]
    alike = one.family == kin.family != "" and parameters[0] == parameters[1]
    return alike and name == moved_name(kin.name, one.slot)


def _outcome(
    true: tuple[str, ...],
    stands_for: Mapping[str, set[str]],
    answer: dict[str, Any],
    kin: Collection[str],
    left_open: Collection[str],
) -> Outcome:
    if "verdict" not in answer:
        return "failed"
    plain: dict[str, Outcome] = {
        "consistent": "consistent", "undecided": "undecided", "unknown_physics": "unknown",
    }  # fmt: skip
    if answer["verdict"] in plain:
        return plain[answer["verdict"]]
    beside = [name for name in stands_for if name in true or name not in kin]
    if beside == list(true) and true:
        return "exact"
    for name in true:
        match = next((n for n in beside if n == name), None) or next(
            (n for n in beside if name in stands_for[n]), None
        )
        if match is not None:
            beside.remove(match)
        elif name not in left_open:
            return "wrong"
    return "wrong" if beside or not true else "family"


def _kin_of(clutter: Sequence[str], catalogue: Catalogue) -> set[str]:
    """Names of the catalogue in the families of these effects; some of the effects are not in the catalogue."""
    families = _families_of(clutter, catalogue)
    return {*clutter, *(name for name, one in catalogue.items() if one.family and one.family in families)}


def by_effort(answer: dict[str, Any]) -> bool:
    """Whether the answer is from effort scoring."""
    return (answer.get("scoring") or {}).get("kind") == "effort"


def _heldout(truth: dict[str, Any], answer: dict[str, Any]) -> float | None:
    # the noise of a recorded effort drives the free run, so that its held-out error does not measure the model
    if by_effort(answer) or (truth.get("rig") or {}).get("recorded") == "effort":
        return None
    error = ((answer.get("fit") or {}).get("augmented") or {}).get("heldout_nrmse")
    floor = truth["floors"].get(str(answer.get("block")))
    return error / floor if error is not None and floor else None


def _estimated(name: str, true: float, given: dict[str, Any] | None) -> list[Estimated]:
    if not given or not given["std"] or not math.isfinite(given["std"]):
        return []
    return [Estimated(name, true, given["value"], given["std"])]


def _effect_estimates(truth: dict[str, Any], answer: dict[str, Any]) -> tuple[Estimated, ...]:
    """Parameters that both descriptions of an effect have; the smoothing speed of a friction is in only one of them."""
    found: list[Estimated] = []
    given = {effect["element"]: effect["parameters"] for effect in answer["missing"]}
    for one in (*truth["concealed"], *truth["clutter"]):
        name = one["effect"]["name"]
        for parameter, value in one["effect"]["parameters"].items():
            found += _estimated(f"{name}.{parameter}", value, given.get(name, {}).get(parameter))
    return tuple(found)


def _machine_estimates(
    truth: dict[str, Any], answer: dict[str, Any], true: tuple[str, ...]
) -> tuple[Estimated, ...]:
    given = answer.get("parameters", {})
    found: list[Estimated] = []
    for name, value in truth["parameters"].items():
        if not (name.endswith("_delay.delay") and NO_SINGLE_DELAY & set(true)):
            found += _estimated(name, value, given.get(name))
    return tuple(found)
