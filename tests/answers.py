"""Answers made by hand, for tests of what becomes of them."""

from rhythmid.diagnose.answer.result import (
    Detection,
    Diagnosis,
    Explanation,
    FitQuality,
    Location,
    MissingEffect,
    Remainder,
    Scored,
)
from rhythmid.diagnose.hypothesis import ScoringKind, Verdict


def diagnosed(
    verdict: Verdict, *names: str, kind: ScoringKind = "free_run", slot: str = "force"
) -> Diagnosis:
    """A diagnosis with these names, all effects of one slot, scored in this way."""
    missing = tuple(MissingEffect(name, slot, "F", 1.0 / len(names), 0.95, {}) for name in names)
    fit = FitQuality(0.05, 0.06)
    return Diagnosis(
        verdict,
        f"The verdict is {verdict}.",
        Detection(None, None, 0.05, 0.004),
        Location(slot if names else None, "there", ()),
        missing,
        0.95,
        (),
        (),
        (Explanation((), "nominal", 0.0, 0.0, 0.0, 0.5, 0.06),),
        (),
        Remainder(0.0, False, None, None),
        {"refitted_nominal": fit, "augmented": fit},
        {},
        {},
        "more of the same",
        Scored(kind, None, "it applies", 1),
    )
